// Real spherical harmonics up to degree 3, in the order and with the signs of 3DGS (harmonics.py), and their slopes.
#pragma once
#include "projection.h"

namespace raster {
namespace ISA {

constexpr int COEFFICIENTS = 16;  // at most
// square roots of 1 / 4, 3 / 4, 15 / 4, 5 / 16, 35 / 32, 105 / 4, 21 / 32 and 7 / 16, all over pi
constexpr float SH0 = 0.28209479f, SH1 = 0.48860251f, SH2A = 1.09254843f, SH2B = 0.31539157f;
constexpr float SH3A = 0.59004359f, SH3B = 2.89061144f, SH3C = 0.45704580f, SH3D = 0.37317633f;

// The unit directions from the camera to LANES Gaussians, and one over their distance (1 for an orthographic camera).
struct ViewDirection {
  Three to;
  Lanes per_length;
  ViewDirection(const Three& offset, const View& view) {
    if (view.orthographic) {
      for (int k = 0; k < 3; k++) to[k] = all(view.rotation[6 + k]);
    } else {
      for (int k = 0; k < 3; k++) to[k] = offset[k];
    }
    per_length = 1.f / sqrt(max(dot(to, to), all(1e-37f)));
    for (int k = 0; k < 3; k++) to[k] *= per_length;
  }
};

// The first `count` basis functions.
static inline void basis_of(const Three& to, int count, Lanes* out) {
  const Lanes x = to[0], y = to[1], z = to[2], xx = x * x, yy = y * y, zz = z * z;
  out[0] = all(SH0);
  if (count < 4) return;
  out[1] = -SH1 * y, out[2] = SH1 * z, out[3] = -SH1 * x;
  if (count < 9) return;
  out[4] = SH2A * x * y, out[5] = -SH2A * y * z, out[6] = SH2B * (3 * zz - 1);
  out[7] = -SH2A * x * z, out[8] = 0.5f * SH2A * (xx - yy);
  if (count < 16) return;
  out[9] = -SH3A * y * (3 * xx - yy), out[10] = SH3B * x * y * z, out[11] = -SH3C * y * (5 * zz - 1);
  out[12] = SH3D * z * (5 * zz - 3), out[13] = -SH3C * x * (5 * zz - 1);
  out[14] = 0.5f * SH3B * z * (xx - yy), out[15] = -SH3A * x * (xx - 3 * yy);
}

// Gradient by the direction of the sum of w_k basis_k; its component along the direction is meaningless.
static inline Three basis_gradient(const Three& to, int count, const Lanes* w) {
  const Lanes x = to[0], y = to[1], z = to[2];
  Three g = {{all(0), all(0), all(0)}};
  if (count < 4) return g;
  g = {{-SH1 * w[3], -SH1 * w[1], SH1 * w[2]}};
  if (count < 9) return g;
  g[0] += SH2A * (w[4] * y - w[7] * z + w[8] * x);
  g[1] += SH2A * (w[4] * x - w[5] * z - w[8] * y);
  g[2] += 6 * SH2B * w[6] * z - SH2A * (w[5] * y + w[7] * x);
  if (count < 16) return g;
  const Lanes flat = x * x - y * y, high = 5 * z * z - 1, xy = x * y, yz = y * z, xz = x * z;
  g[0] += SH3B * (w[10] * yz + w[14] * xz) - SH3C * w[13] * high - 3 * SH3A * (2 * w[9] * xy + w[15] * flat);
  g[1] += SH3B * (w[10] * xz - w[14] * yz) - SH3C * w[11] * high - 3 * SH3A * (w[9] * flat - 2 * w[15] * xy);
  g[2] += SH3B * (w[10] * xy + 0.5f * w[14] * flat) - 10 * SH3C * (w[11] * yz + w[13] * xz) + 3 * SH3D * w[12] * high;
  return g;
}

// max(0, 1/2 + sum over k of basis_k sh_k). Clears `valid` where a coefficient is not finite.
static inline Three shade(const Scene& scene, const View& view, const Rows& rows, const Three& offset, Mask visible,
                          bool& valid) {
  const int count = scene.coefficients;
  Lanes basis[COEFFICIENTS];
  basis_of(ViewDirection(offset, view).to, count, basis);
  Three colour = {{all(0.5f), all(0.5f), all(0.5f)}};
  Whole finite = finite_bits(all(0));
  for (int k = 0; k < count; k++)
    for (int c = 0; c < 3; c++) {
      const Lanes sh = rows.load(scene.colours + 3 * k + c, 3 * count);
      finite &= finite_bits(sh);
      colour[c] += basis[k] * sh;
    }
  valid = !any(visible & ~mask_of(finite));
  for (int c = 0; c < 3; c++) colour[c] = max(colour[c], all(0));
  return colour;
}

// The backward pass of `shade` from `by_colour`, 0 where the colour was clamped at 0: writes the gradients by the
// coefficients, returns those by the Gaussian's position (orthographic: by the view's direction).
static inline Three shade_backward(const Scene& scene, const View& view, const Rows& rows, const Three& offset,
                                   const Three& by_colour, float* out) {
  const int count = scene.coefficients;
  const ViewDirection direction(offset, view);
  Lanes basis[COEFFICIENTS], weight[COEFFICIENTS];
  basis_of(direction.to, count, basis);
  for (int k = 0; k < count; k++) {
    weight[k] = all(0);
    for (int c = 0; c < 3; c++) {
      rows.store(out + 3 * k + c, 3 * count, basis[k] * by_colour[c]);
      if (count > 1) weight[k] += by_colour[c] * rows.load(scene.colours + 3 * k + c, 3 * count);
    }
  }
  Three slope = basis_gradient(direction.to, count, weight);
  const Lanes along = dot(slope, direction.to);
  for (int k = 0; k < 3; k++) slope[k] = (slope[k] - along * direction.to[k]) * direction.per_length;
  return slope;
}

}  // namespace ISA
}  // namespace raster
