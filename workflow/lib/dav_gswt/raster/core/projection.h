// The projection of LANES Gaussians onto the screen, step by step, for the forward pass and for the backward pass.
//
// With c_k = (p_k, q_k) the image of the k-th axis under the linearised camera, the splat's covariance is
// S = sum_k c_k c_k^T + dilation I. Its determinant is taken as |p x q|^2 + dilation (|p|^2 + |q|^2) + dilation^2
// (Lagrange's identity): a sum of positive terms, where S_xx S_yy - S_xy^2 loses every digit of a needle. The first
// term alone is the determinant without the dilation.
#pragma once
#include "lanes.h"

namespace raster {
namespace ISA {

constexpr float MARGIN = 0.15f;  // of the picture's side: further out the camera is linearised at this rim
constexpr float LOG_SCALE_MAX = 46;  // 1e20, so that no product below is infinite
constexpr float AXIS_MAX = 1e11f;  // pixels; beyond this a splat is flat over any picture
constexpr float DET_MAX = 3e38f;  // above is infinity: the square of an area beyond any picture

struct Three {
  Lanes v[3];
  Lanes& operator[](int k) { return v[k]; }
  const Lanes& operator[](int k) const { return v[k]; }
};

static inline Lanes dot(const Three& a, const Three& b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }

// The rows of LANES candidates; with fewer left the last one is repeated.
struct Rows {
  size_t at[LANES];
  int count;
  Rows(const Candidates& candidates, size_t first) {
    const size_t left = candidates.count - first;
    count = left < LANES ? left : LANES;
    for (int l = 0; l < LANES; l++) at[l] = candidates.row[first + (l < count ? l : count - 1)];
  }
  Lanes load(const float* column, int stride) const {
    float buffer[LANES];
    for (int l = 0; l < LANES; l++) buffer[l] = column[at[l] * stride];
    return ISA::load(buffer);
  }
  Three load3(const float* rows) const { return {{load(rows, 3), load(rows + 1, 3), load(rows + 2, 3)}}; }
  void store(float* column, int stride, Lanes v) const {
    for (int l = 0; l < count; l++) column[at[l] * stride] = v[l];
  }
};

struct Projection {
  Three offset;  // of the mean from the camera, in the axes of the world
  Lanes x, y, z;  // in the camera
  Lanes per_z;  // 1 / z, or 1
  Lanes slope_x, slope_y;  // x / z, y / z
  Lanes bound_x, bound_y;  // the same within the picture and its margin
  Lanes jxx, jxz, jyy, jyz;  // the camera's Jacobian
  Three u, v;  // its rows in the world: J R
  Lanes quat[4], quat_norm;  // unit quaternion; 1 / length
  Lanes rotation[9];
  Three scale;
  Three p, q;  // images of the scaled axes
  Lanes cxy[3];  // p x q: components 01, 02, 12
  Lanes sxx, sxy, syy;
  Lanes area, trace, det;  // |p x q|^2, |p|^2 + |q|^2, det S
  Lanes logit, opacity;
  Lanes compensation;  // sqrt(det S0 / det S) of an antialiased splat, else 1
  bool valid;  // inputs are finite and no quaternion is zero
};

static inline void rotation_of(const Lanes q[4], Lanes m[9]) {
  const Lanes w = q[0], x = q[1], y = q[2], z = q[3];
  m[0] = 1 - 2 * (y * y + z * z), m[1] = 2 * (x * y - w * z), m[2] = 2 * (x * z + w * y);
  m[3] = 2 * (x * y + w * z), m[4] = 1 - 2 * (x * x + z * z), m[5] = 2 * (y * z - w * x);
  m[6] = 2 * (x * z - w * y), m[7] = 2 * (y * z + w * x), m[8] = 1 - 2 * (x * x + y * y);
}

// From the mean to the camera's frame and its Jacobian there. Near a camera that is far out R m + t would cancel; the
// difference of two near numbers is exact.
static inline void to_camera(Projection& c, const Three& mean, const View& view) {
  for (int k = 0; k < 3; k++) c.offset[k] = (mean[k] - view.centre[k]) - view.centre_rest[k];
  const float* r = view.rotation;
  c.x = r[0] * c.offset[0] + r[1] * c.offset[1] + r[2] * c.offset[2];
  c.y = r[3] * c.offset[0] + r[4] * c.offset[1] + r[5] * c.offset[2];
  c.z = r[6] * c.offset[0] + r[7] * c.offset[1] + r[8] * c.offset[2];
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

static inline void to_screen(Projection& c, const View& view) {
  for (int k = 0; k < 3; k++) {
    const Lanes* r = &c.rotation[k];
    c.p[k] = clamp(c.scale[k] * (c.u[0] * r[0] + c.u[1] * r[3] + c.u[2] * r[6]), -AXIS_MAX, AXIS_MAX);
    c.q[k] = clamp(c.scale[k] * (c.v[0] * r[0] + c.v[1] * r[3] + c.v[2] * r[6]), -AXIS_MAX, AXIS_MAX);
  }
  c.cxy[0] = c.p[0] * c.q[1] - c.p[1] * c.q[0];
  c.cxy[1] = c.p[0] * c.q[2] - c.p[2] * c.q[0];
  c.cxy[2] = c.p[1] * c.q[2] - c.p[2] * c.q[1];
  const Lanes pp = dot(c.p, c.p), qq = dot(c.q, c.q);
  const float dilation = view.dilation;
  c.sxx = pp + dilation;
  c.sxy = dot(c.p, c.q);
  c.syy = qq + dilation;
  c.area = c.cxy[0] * c.cxy[0] + c.cxy[1] * c.cxy[1] + c.cxy[2] * c.cxy[2];
  c.trace = pp + qq;
  c.det = c.area + dilation * c.trace + dilation * dilation;
  c.compensation = view.antialiased ? sqrt(select(below(c.det, all(DET_MAX)), c.area / c.det, all(1))) : all(1);
}

static inline Projection project_lanes(const Scene& scene, const View& view, const Rows& rows) {
  Projection c;
  const Three mean = rows.load3(scene.means);
  const Three log_scale = rows.load3(scene.log_scales);
  for (int k = 0; k < 4; k++) c.quat[k] = rows.load(scene.quats + k, 4);
  const Lanes logit = c.logit = rows.load(scene.opacity_logits, 1);

  Whole finite = finite_bits(logit);
  for (int k = 0; k < 3; k++) finite &= finite_bits(mean[k]) & finite_bits(log_scale[k]);
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

  rotation_of(c.quat, c.rotation);
  for (int k = 0; k < 3; k++) c.scale[k] = exp(clamp(log_scale[k], -LOG_SCALE_MAX * 1.5f, LOG_SCALE_MAX));
  c.opacity = 1.f / (1.f + exp(-logit));
  to_camera(c, mean, view);
  to_screen(c, view);
  return c;
}

}  // namespace ISA
}  // namespace raster
