// Gradients by the Gaussians and by the camera from those by their splats on the screen; LANES at a time.
//
// A small motion of the camera, q' = q + w x q + tau in its own frame, moves each Gaussian there, turns the axes that
// are projected (R' = R + [w]R) and shifts the point that colours are seen from: gradients by w and tau are sums over
// all Gaussians, taken of groups in float32 and over the groups in float64, in their order.
#include "harmonics.h"
#include "kernels.h"

namespace raster {
namespace ISA {

// The inverse of a splat's covariance.
struct Conic {
  Lanes xx, xy, yy, per_det;
  explicit Conic(const Projection& c)
      : xx(c.syy / c.det), xy(-c.sxy / c.det), yy(c.sxx / c.det), per_det(1.f / c.det) {}
};

struct AxisGradients {
  Three p, q, log_scale;
};

// dL/d(p, q) from the moments of v = dL / d ln alpha. With K = S^-1 and m the second moments,
// dL/dc_k = K m (K c_k), and dL/dlog scale_k = c_k . dL/dc_k = (K c_k) . m (K c_k). K c_k is made of cross products
// again: it is tiny along a needle, where K and c_k are not.
//
// An antialiased splat's opacity adds sum(v) (S0^-1 - K) c_k, S0 = S - dilation I. With x_k = area S0^-1 c_k the cross
// products as above and det = area + dilation (trace + dilation), the difference of the inverses is taken before it
// cancels: dilation (x_k (trace + dilation) / area - c_k) / det.
static inline AxisGradients covariance_backward(const Projection& c, const View& view, const Conic& conic,
                                                const Lanes* moments) {
  const float dilation = view.dilation;
  const Lanes xx = moments[3], xy = moments[4], yy = moments[5], *s = c.cxy;
  const Lanes px[3] = {c.q[1] * s[0] + c.q[2] * s[1], c.q[2] * s[2] - c.q[0] * s[0], -c.q[0] * s[1] - c.q[1] * s[2]};
  const Lanes py[3] = {-c.p[1] * s[0] - c.p[2] * s[1], c.p[0] * s[0] - c.p[2] * s[2], c.p[0] * s[1] + c.p[1] * s[2]};
  AxisGradients d;
  for (int k = 0; k < 3; k++) {
    const Lanes kcx = (px[k] + dilation * c.p[k]) * conic.per_det, kcy = (py[k] + dilation * c.q[k]) * conic.per_det;
    const Lanes mx = xx * kcx + xy * kcy, my = xy * kcx + yy * kcy;
    d.p[k] = conic.xx * mx + conic.xy * my;
    d.q[k] = conic.xy * mx + conic.yy * my;
    d.log_scale[k] = kcx * mx + kcy * my;
  }
  if (!view.antialiased) return d;
  const Lanes per_area = 1.f / max(c.area, all(1e-37f)), share = (c.trace + dilation) * conic.per_det;
  for (int k = 0; k < 3; k++) {
    const Lanes x = dilation * moments[0] * (px[k] * per_area * share - c.p[k] * conic.per_det);
    const Lanes y = dilation * moments[0] * (py[k] * per_area * share - c.q[k] * conic.per_det);
    d.p[k] += x;
    d.q[k] += y;
    d.log_scale[k] += c.p[k] * x + c.q[k] * y;
  }
  return d;
}

// dL/dquaternion from d = dL/drotation, through the division by its length.
static inline void rotation_backward(const Projection& c, const Lanes d[9], Lanes out[4]) {
  const Lanes w = c.quat[0], x = c.quat[1], y = c.quat[2], z = c.quat[3];
  const Lanes g[4] = {
      2 * (x * (d[7] - d[5]) + y * (d[2] - d[6]) + z * (d[3] - d[1])),
      2 * (y * (d[1] + d[3]) + z * (d[2] + d[6]) - 2 * x * (d[4] + d[8]) + w * (d[7] - d[5])),
      2 * (x * (d[1] + d[3]) + z * (d[5] + d[7]) - 2 * y * (d[0] + d[8]) + w * (d[2] - d[6])),
      2 * (x * (d[2] + d[6]) + y * (d[5] + d[7]) - 2 * z * (d[0] + d[4]) + w * (d[3] - d[1])),
  };
  const Lanes along = g[0] * w + g[1] * x + g[2] * y + g[3] * z;
  for (int k = 0; k < 4; k++) out[k] = (g[k] - along * c.quat[k]) * c.quat_norm;
}

// Vectors of the world in the camera's frame, and back.
static inline Three to_camera_frame(const View& view, const Three& a) {
  const float* r = view.rotation;
  return {{r[0] * a[0] + r[1] * a[1] + r[2] * a[2], r[3] * a[0] + r[4] * a[1] + r[5] * a[2],
           r[6] * a[0] + r[7] * a[1] + r[8] * a[2]}};
}

static inline Three to_world_frame(const View& view, const Three& a) {
  const float* r = view.rotation;
  Three out;
  for (int k = 0; k < 3; k++) out[k] = r[k] * a[0] + r[3 + k] * a[1] + r[6 + k] * a[2];
  return out;
}

// dL by the position in the camera's frame from the gradients of the splat's centre (dx, dy), of its depth, and of the
// Jacobian's rows, du and dv (in the camera's frame too).
static inline Three position_backward(const Projection& c, const View& view, Lanes dx, Lanes dy, Lanes dz,
                                      const Three& du, const Three& dv) {
  Three out = {{c.jxx * dx, c.jyy * dy, dz}};
  if (view.orthographic) return out;
  const Lanes dslope_x = where(mask_of(c.bound_x == c.slope_x), -c.jxx * du[2]);
  const Lanes dslope_y = where(mask_of(c.bound_y == c.slope_y), -c.jyy * dv[2]);
  out[0] += dslope_x * c.per_z;
  out[1] += dslope_y * c.per_z;
  const Lanes along_x = view.fx * dx + dslope_x, along_y = view.fy * dy + dslope_y;
  out[2] -= c.per_z *
            (c.jxx * du[0] + c.jxz * du[2] + c.jyy * dv[1] + c.jyz * dv[2] + c.slope_x * along_x + c.slope_y * along_y);
  return out;
}

// dL by (w, tau) from the gradient by the position in the camera's frame and those of the Jacobian's rows.
static inline void motion_backward(const Projection& c, const Three& by_place, const Three& du, const Three& dv,
                                   Lanes out[6]) {
  out[0] = c.y * by_place[2] - c.z * by_place[1] + du[1] * c.jxz + dv[1] * c.jyz - dv[2] * c.jyy;
  out[1] = c.z * by_place[0] - c.x * by_place[2] + du[2] * c.jxx - du[0] * c.jxz - dv[0] * c.jyz;
  out[2] = c.x * by_place[1] - c.y * by_place[0] - du[1] * c.jxx + dv[0] * c.jyy;
  for (int k = 0; k < 3; k++) out[3 + k] = by_place[k];
}

// Adds what the colours contribute to the gradients by mean and motion.
static inline void colour_backward(const Scene& scene, const View& view, const Rows& rows, const Projection& c,
                                   size_t first, Mask visible, const float* sh_colours, const float* by_sh_colours,
                                   const SceneGradients& out, Three& dmean, Lanes dmotion[6]) {
  Three by_colour;
  for (int k = 0; k < 3; k++) {
    const Lanes colour = load_column(sh_colours + k, 3, first, rows.count);
    const Lanes by = load_column(by_sh_colours + k, 3, first, rows.count);
    by_colour[k] = where(visible & below(all(0), colour), by);
  }
  const Three by_direction = shade_backward(scene, view, rows, c.offset, by_colour, out.colours);
  const Three h = to_camera_frame(view, by_direction);
  if (view.orthographic) {  // the view's direction, which is the third row of the rotation
    dmotion[0] += where(visible, h[1]);
    dmotion[1] -= where(visible, h[0]);
    return;
  }
  for (int k = 0; k < 3; k++) {
    dmean[k] += by_direction[k];
    dmotion[3 + k] += where(visible, h[k]);
  }
}

static void project_backward_group(const Scene& scene, const View& view, const Candidates& candidates,
                                   const Splat* splats, const float* sums, const float* sh_colours,
                                   const float* by_sh_colours, float* motion, const SceneGradients& out, size_t first) {
  const Rows rows(candidates, first);
  const Projection c = project_lanes(scene, view, rows);
  Whole seen = {};
  for (int l = 0; l < rows.count; l++) seen[l] = -(int)splats[first + l].visible();
  const Mask visible = mask_of(seen);
  Lanes moments[MOMENTS + 1];
  for (int k = 0; k <= MOMENTS; k++) moments[k] = load_column(sums + k, MOMENTS + 1, first, rows.count);

  const Conic conic(c);
  const AxisGradients d = covariance_backward(c, view, conic, moments);
  Lanes drotation[9], dquat[4];
  Three du, dv;  // by the rows of J R, in the world
  for (int r = 0; r < 3; r++) {
    du[r] = dv[r] = all(0);
    for (int k = 0; k < 3; k++) {
      drotation[3 * r + k] = c.scale[k] * (d.p[k] * c.u[r] + d.q[k] * c.v[r]);
      du[r] += d.p[k] * c.scale[k] * c.rotation[3 * r + k];
      dv[r] += d.q[k] * c.scale[k] * c.rotation[3 * r + k];
    }
  }
  rotation_backward(c, drotation, dquat);
  const Lanes dx = conic.xx * moments[1] + conic.xy * moments[2], dy = conic.xy * moments[1] + conic.yy * moments[2];
  du = to_camera_frame(view, du), dv = to_camera_frame(view, dv);
  const Three by_place = position_backward(c, view, dx, dy, moments[MOMENTS], du, dv);
  Three dmean = to_world_frame(view, by_place);
  Lanes dmotion[6];
  motion_backward(c, by_place, du, dv, dmotion);
  for (int k = 0; k < 6; k++) dmotion[k] = where(visible, dmotion[k]);
  if (scene.coefficients)
    colour_backward(scene, view, rows, c, first, visible, sh_colours, by_sh_colours, out, dmean, dmotion);

  for (int k = 0; k < 3; k++) {
    rows.store(out.means + k, 3, where(visible, dmean[k]));
    rows.store(out.log_scales + k, 3, where(visible, d.log_scale[k]));
  }
  for (int k = 0; k < 4; k++) rows.store(out.quats + k, 4, where(visible, dquat[k]));
  const Lanes transparency = 1.f / (1.f + exp(c.logit));  // 1 - opacity would cancel
  rows.store(out.opacity_logits, 1, where(visible, moments[0] * transparency));
  store_sums<6>(motion, dmotion);
}

void project_backward(const Scene& scene, const View& view, const Candidates& candidates, const Splat* splats,
                      const float* sums, const float* sh_colours, const float* by_sh_colours, float* motions,
                      const SceneGradients& out, int threads) {
  const ptrdiff_t groups = (candidates.count + LANES - 1) / LANES;
#pragma omp parallel for num_threads(threads) schedule(static)
  for (ptrdiff_t g = 0; g < groups; g++)
    project_backward_group(scene, view, candidates, splats, sums, sh_colours, by_sh_colours, motions + 6 * g, out,
                           g * LANES);
  double total[6] = {};
  for (ptrdiff_t g = 0; g < groups; g++)
    for (int k = 0; k < 6; k++) total[k] += motions[6 * g + k];
  for (int k = 0; k < 6; k++) out.camera[k] = total[k];
}

}  // namespace ISA
}  // namespace raster
