// From Gaussians in the world to splats on the screen, and the gradients' way back; LANES Gaussians at a time.
//
// With c_k = (p_k, q_k) the image of the k-th axis under the linearised camera, the splat's covariance is
// S = sum_k c_k c_k^T + dilation I. Its determinant is taken as |p x q|^2 + dilation (|p|^2 + |q|^2) + dilation^2
// (Lagrange's identity): a sum of positive terms, where S_xx S_yy - S_xy^2 loses every digit of a needle.
#include "kernels.h"
#include "lanes.h"

namespace raster {
namespace ISA {

static const float MARGIN = 0.15f;      // of the picture's side: further out the camera is linearised at this rim
static const float LOG_SCALE_MAX = 46;  // 1e20, so that no product below is infinite
static const float AXIS_MAX = 1e11f;    // pixels; beyond this a splat is flat over any picture

struct Three {
  Lanes v[3];
  Lanes& operator[](int k) { return v[k]; }
  const Lanes& operator[](int k) const { return v[k]; }
};

static inline Lanes dot(const Three& a, const Three& b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }

static inline Three columns(const float* rows, size_t row, int count) {
  return {{load_column(rows, 3, row, count), load_column(rows + 1, 3, row, count),
           load_column(rows + 2, 3, row, count)}};
}

// Every step from the parameters of LANES Gaussians to the screen.
struct Chain {
  Three mean;                // in the world
  Lanes x, y, z;             // in the camera
  Lanes per_z;               // 1 / z, or 1
  Lanes slope_x, slope_y;    // x / z, y / z
  Lanes bound_x, bound_y;    // the same within the picture and its margin
  Lanes jxx, jxz, jyy, jyz;  // the camera's Jacobian
  Three u, v;                // its rows in the world: J R
  Lanes quat[4], quat_norm;  // unit quaternion; 1 / length
  Lanes turn[9];             // rotation matrix
  Three scale;
  Three p, q;                // images of the scaled axes
  Lanes cxy[3];              // p x q: components 01, 02, 12
  Lanes sxx, sxy, syy, det;
  Lanes opacity;
  bool valid;                // inputs are finite and no quaternion is zero
};

static inline void turn_of(const Lanes q[4], Lanes m[9]) {
  const Lanes w = q[0], x = q[1], y = q[2], z = q[3];
  m[0] = 1 - 2 * (y * y + z * z), m[1] = 2 * (x * y - w * z), m[2] = 2 * (x * z + w * y);
  m[3] = 2 * (x * y + w * z), m[4] = 1 - 2 * (x * x + z * z), m[5] = 2 * (y * z - w * x);
  m[6] = 2 * (x * z - w * y), m[7] = 2 * (y * z + w * x), m[8] = 1 - 2 * (x * x + y * y);
}

static inline void place(Chain& c, const View& view) {
  const float *r = view.rotation, *t = view.translation;
  c.x = r[0] * c.mean[0] + r[1] * c.mean[1] + r[2] * c.mean[2] + t[0];
  c.y = r[3] * c.mean[0] + r[4] * c.mean[1] + r[5] * c.mean[2] + t[1];
  c.z = r[6] * c.mean[0] + r[7] * c.mean[1] + r[8] * c.mean[2] + t[2];
  c.per_z = view.orthographic ? all(1) : 1.f / max(c.z, all(view.near));
  c.slope_x = c.x * c.per_z;
  c.slope_y = c.y * c.per_z;
  const float margin_x = MARGIN * view.width, margin_y = MARGIN * view.height;
  c.bound_x = clamp(c.slope_x, -(view.cx + margin_x) / view.fx, (view.width - view.cx + margin_x) / view.fx);
  c.bound_y = clamp(c.slope_y, -(view.cy + margin_y) / view.fy, (view.height - view.cy + margin_y) / view.fy);
  c.jxx = view.fx * c.per_z;
  c.jyy = view.fy * c.per_z;
  c.jxz = view.orthographic ? all(0) : -c.jxx * c.bound_x;
  c.jyz = view.orthographic ? all(0) : -c.jyy * c.bound_y;
  for (int k = 0; k < 3; k++) {
    c.u[k] = c.jxx * r[k] + c.jxz * r[6 + k];
    c.v[k] = c.jyy * r[3 + k] + c.jyz * r[6 + k];
  }
}

static inline void spread(Chain& c, float dilation) {
  for (int k = 0; k < 3; k++) {
    c.p[k] = clamp(c.scale[k] * (c.u[0] * c.turn[k] + c.u[1] * c.turn[3 + k] + c.u[2] * c.turn[6 + k]), -AXIS_MAX,
                   AXIS_MAX);
    c.q[k] = clamp(c.scale[k] * (c.v[0] * c.turn[k] + c.v[1] * c.turn[3 + k] + c.v[2] * c.turn[6 + k]), -AXIS_MAX,
                   AXIS_MAX);
  }
  c.cxy[0] = c.p[0] * c.q[1] - c.p[1] * c.q[0];
  c.cxy[1] = c.p[0] * c.q[2] - c.p[2] * c.q[0];
  c.cxy[2] = c.p[1] * c.q[2] - c.p[2] * c.q[1];
  const Lanes pp = dot(c.p, c.p), qq = dot(c.q, c.q);
  c.sxx = pp + dilation;
  c.sxy = dot(c.p, c.q);
  c.syy = qq + dilation;
  c.det = c.cxy[0] * c.cxy[0] + c.cxy[1] * c.cxy[1] + c.cxy[2] * c.cxy[2] + dilation * (pp + qq) + dilation * dilation;
}

static inline Chain chain(const Scene& scene, const View& view, size_t i, int count) {
  Chain c;
  c.mean = columns(scene.means, i, count);
  const Three log_scale = columns(scene.log_scales, i, count);
  for (int k = 0; k < 4; k++) c.quat[k] = load_column(scene.quats + k, 4, i, count);
  const Lanes logit = load_column(scene.opacity_logits, 1, i, count);

  Whole finite = finite_bits(logit);
  for (int k = 0; k < 3; k++) finite &= finite_bits(c.mean[k]) & finite_bits(log_scale[k]);
  for (int k = 0; k < 4; k++) finite &= finite_bits(c.quat[k]);
  // a quaternion is first divided by its largest component: its square may be out of range
  Lanes largest = all(0);
  for (int k = 0; k < 4; k++) largest = max(largest, max(c.quat[k], -c.quat[k]));
  c.valid = every(mask_of(finite) & at_least(largest, all(1e-37f)));
  const Lanes per_largest = 1.f / largest;
  Lanes length = all(0);
  for (int k = 0; k < 4; k++) c.quat[k] *= per_largest, length += c.quat[k] * c.quat[k];
  length = 1.f / sqrt(length);
  for (int k = 0; k < 4; k++) c.quat[k] *= length;
  c.quat_norm = per_largest * length;

  turn_of(c.quat, c.turn);
  for (int k = 0; k < 3; k++) c.scale[k] = exp(clamp(log_scale[k], -LOG_SCALE_MAX * 1.5f, LOG_SCALE_MAX));
  c.opacity = 1.f / (1.f + exp(-logit));
  place(c, view);
  spread(c, view.dilation);
  return c;
}

// ceil(v) of a number within [0, 32767], as pixels
static inline Whole ceiling(Lanes v) {
  const Whole truncated = __builtin_convertvector(v, Whole);
  return truncated - (__builtin_convertvector(truncated, Lanes) < v);
}

static inline void store_splats(const Chain& c, const View& view, Splat* splats, int count) {
  const Lanes per_det = 1.f / c.det;
  const Lanes log2_opacity = log2(max(c.opacity, all(1e-37f)));
  const Lanes reach = 2 * LN2 * (log2_opacity + LOG2_255);  // the quadratic form at the rim
  const Lanes half_x = sqrt(max(reach * c.sxx, all(0))), half_y = sqrt(max(reach * c.syy, all(0)));
  const Lanes x = view.fx * c.slope_x + view.cx, y = view.fy * c.slope_y + view.cy;
  const Mask drawn = at_least(c.z, all(view.orthographic ? 1e-30f : view.near)) & at_least(reach, all(0)) &
                     at_least(c.det, all(1e-30f));
  // the first pixel whose centre lies in the box, and the first beyond it
  const float width = view.width, height = view.height;
  const Lanes end_x = clamp(x + half_x - 0.5f, 0, width), end_y = clamp(y + half_y - 0.5f, 0, height);
  const Whole boxes[] = {ceiling(clamp(x - half_x - 0.5f, 0, width)), ceiling(clamp(y - half_y - 0.5f, 0, height)),
                         ceiling(select(drawn, end_x, all(0))), ceiling(end_y)};
  const Lanes fields[] = {x, y, -0.5f * LOG2_E * (c.syy * per_det), LOG2_E * (c.sxy * per_det),
                          -0.5f * LOG2_E * (c.sxx * per_det), log2_opacity, half_x, half_y, c.z};
  float buffer[9][LANES];
  int box[4][LANES];
  for (int f = 0; f < 9; f++) store(buffer[f], fields[f]);
  memcpy(box, boxes, sizeof box);
  for (int l = 0; l < count; l++) {
    Splat& s = splats[l];
    s.x = buffer[0][l], s.y = buffer[1][l];
    s.xx = buffer[2][l], s.xy = buffer[3][l], s.yy = buffer[4][l];
    s.log2_opacity = buffer[5][l];
    s.half_x = buffer[6][l], s.half_y = buffer[7][l];
    s.depth = buffer[8][l];
    const bool any_pixel = box[0][l] < box[2][l] && box[1][l] < box[3][l];
    s.left = box[0][l], s.top = box[1][l];
    s.right = any_pixel ? box[2][l] - 1 : -1, s.bottom = any_pixel ? box[3][l] - 1 : -1;
  }
}

bool project(const Scene& scene, const View& view, Splat* splats, int threads) {
  const ptrdiff_t groups = (scene.n + LANES - 1) / LANES;
  int invalid = 0;
#pragma omp parallel for num_threads(threads) schedule(static) reduction(| : invalid)
  for (ptrdiff_t g = 0; g < groups; g++) {
    const size_t i = g * LANES;
    const int count = scene.n - i < LANES ? scene.n - i : LANES;
    const Chain c = chain(scene, view, i, count);
    invalid |= !c.valid;
    store_splats(c, view, splats + i, count);
  }
  return !invalid;
}

bool load_colours(const Scene& scene, int channel, int group, Splat* splats, int threads) {
  int invalid = 0;
#pragma omp parallel for num_threads(threads) schedule(static) reduction(| : invalid)
  for (ptrdiff_t i = 0; i < (ptrdiff_t)scene.n; i++) {
    const float* from = scene.colours + i * scene.channels + channel;
    float colour[GROUP] = {};
    for (int k = 0; k < group; k++) {
      colour[k] = from[k];
      invalid |= !__builtin_isfinite(from[k]);
    }
    if (splats[i].drawn()) memcpy(splats[i].colour, colour, sizeof colour);
  }
  return !invalid;
}

// dL/d(p, q) from the moments of v = dL / d ln alpha. With K = S^-1 and m the second moments,
// dL/dc_k = K m (K c_k), and dL/dlog scale_k = c_k . dL/dc_k = (K c_k) . m (K c_k). K c_k is made of cross products
// again: it is tiny along a needle, where K and c_k are not.
static inline void unspread(const Chain& c, float dilation, const Lanes moments[MOMENTS], Lanes kxx, Lanes kxy,
                            Lanes kyy, Lanes per_det, Three& dp, Three& dq, Three& dlog_scale) {
  const Lanes xx = moments[3], xy = moments[4], yy = moments[5], *s = c.cxy;
  const Lanes px[3] = {c.q[1] * s[0] + c.q[2] * s[1], c.q[2] * s[2] - c.q[0] * s[0], -c.q[0] * s[1] - c.q[1] * s[2]};
  const Lanes py[3] = {-c.p[1] * s[0] - c.p[2] * s[1], c.p[0] * s[0] - c.p[2] * s[2], c.p[0] * s[1] + c.p[1] * s[2]};
  for (int k = 0; k < 3; k++) {
    const Lanes kcx = (px[k] + dilation * c.p[k]) * per_det, kcy = (py[k] + dilation * c.q[k]) * per_det;
    const Lanes mx = xx * kcx + xy * kcy, my = xy * kcx + yy * kcy;
    dp[k] = kxx * mx + kxy * my;
    dq[k] = kxy * mx + kyy * my;
    dlog_scale[k] = kcx * mx + kcy * my;
  }
}

// dL/dquaternion from d = dL/dturn, through the division by its length.
static inline void unturn(const Chain& c, const Lanes d[9], Lanes out[4]) {
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

// dL/dmean from the gradients of the splat's centre, depth, and of the Jacobian's rows u and v.
static inline Three unplace(const Chain& c, const View& view, Lanes dx, Lanes dy, Lanes dz, const Three& du,
                            const Three& dv) {
  const float* r = view.rotation;
  Lanes camera_x = c.jxx * dx, camera_y = c.jyy * dy, camera_z = dz;
  if (!view.orthographic) {
    const Lanes djxx = du[0] * r[0] + du[1] * r[1] + du[2] * r[2], djxz = du[0] * r[6] + du[1] * r[7] + du[2] * r[8];
    const Lanes djyy = dv[0] * r[3] + dv[1] * r[4] + dv[2] * r[5], djyz = dv[0] * r[6] + dv[1] * r[7] + dv[2] * r[8];
    const Lanes dslope_x = where(mask_of(c.bound_x == c.slope_x), -c.jxx * djxz);
    const Lanes dslope_y = where(mask_of(c.bound_y == c.slope_y), -c.jyy * djyz);
    camera_x += dslope_x * c.per_z;
    camera_y += dslope_y * c.per_z;
    const Lanes along_x = view.fx * dx + dslope_x, along_y = view.fy * dy + dslope_y;
    camera_z -= c.per_z * (c.jxx * djxx + c.jxz * djxz + c.jyy * djyy + c.jyz * djyz + c.slope_x * along_x +
                           c.slope_y * along_y);
  }
  Three out;
  for (int k = 0; k < 3; k++) out[k] = r[k] * camera_x + r[3 + k] * camera_y + r[6 + k] * camera_z;
  return out;
}

static void project_backward_group(const Scene& scene, const View& view, const Splat* splats, const float* sums,
                                   const SceneGradients& out, size_t i, int count) {
  const Chain c = chain(scene, view, i, count);
  Whole seen = {};
  for (int l = 0; l < count; l++) seen[l] = -(int)splats[i + l].drawn();
  const Mask drawn = mask_of(seen);
  Lanes moments[MOMENTS + 1];
  for (int k = 0; k <= MOMENTS; k++) moments[k] = load_column(sums + k, MOMENTS + 1, i, count);

  const Lanes per_det = 1.f / c.det;
  const Lanes kxx = c.syy * per_det, kxy = -c.sxy * per_det, kyy = c.sxx * per_det;
  Three dp, dq, du, dv, dlog_scale;
  unspread(c, view.dilation, moments, kxx, kxy, kyy, per_det, dp, dq, dlog_scale);
  Lanes dturn[9], dquat[4];
  for (int k = 0; k < 3; k++)
    for (int r = 0; r < 3; r++) dturn[3 * r + k] = c.scale[k] * (dp[k] * c.u[r] + dq[k] * c.v[r]);
  for (int r = 0; r < 3; r++) {
    du[r] = dp[0] * c.scale[0] * c.turn[3 * r] + dp[1] * c.scale[1] * c.turn[3 * r + 1] +
            dp[2] * c.scale[2] * c.turn[3 * r + 2];
    dv[r] = dq[0] * c.scale[0] * c.turn[3 * r] + dq[1] * c.scale[1] * c.turn[3 * r + 1] +
            dq[2] * c.scale[2] * c.turn[3 * r + 2];
  }
  unturn(c, dturn, dquat);
  const Lanes dx = kxx * moments[1] + kxy * moments[2], dy = kxy * moments[1] + kyy * moments[2];
  const Three dmean = unplace(c, view, dx, dy, moments[MOMENTS], du, dv);

  for (int k = 0; k < 3; k++) {
    store_column(out.means + k, 3, i, count, where(drawn, dmean[k]));
    store_column(out.log_scales + k, 3, i, count, where(drawn, dlog_scale[k]));
  }
  for (int k = 0; k < 4; k++) store_column(out.quats + k, 4, i, count, where(drawn, dquat[k]));
  store_column(out.opacity_logits, 1, i, count, where(drawn, moments[0] * (1.f - c.opacity)));
}

void project_backward(const Scene& scene, const View& view, const Splat* splats, const float* sums,
                      const SceneGradients& out, int threads) {
  const ptrdiff_t groups = (scene.n + LANES - 1) / LANES;
#pragma omp parallel for num_threads(threads) schedule(static)
  for (ptrdiff_t g = 0; g < groups; g++) {
    const size_t i = g * LANES;
    project_backward_group(scene, view, splats, sums, out, i, scene.n - i < LANES ? scene.n - i : LANES);
  }
}

}  // namespace ISA
}  // namespace raster
