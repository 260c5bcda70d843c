// Culling: which Gaussians may be visible, by a bound of their size. Most of a large field's are not, and this is all
// that they cost.
//
// Whatever way a splat's axes lie, S_xx <= s^2 |u|^2 + dilation with s the largest scale and u the first row of J R;
// and alpha falls below 1/255 within sqrt(2 ln(255) S_xx) of the centre.
#include "projection.h"
#include "kernels.h"

namespace raster {
namespace ISA {

constexpr float REACH = 2 * LN2 * LOG2_255;  // the quadratic form at the rim of an opaque splat
constexpr float SLACK = 1.001f, ROUNDING = 0.01f;  // wider, and further by pixels, than float32 can be off

static inline Three triples(const float* rows, size_t first, int count) {
  Three out;
  if (count == LANES) load_triples(rows + 3 * first, out.v);
  else
    for (int k = 0; k < 3; k++) out[k] = load_column(rows + k, 3, first, count);
  return out;
}

// Lanes of the Gaussians that certainly have no pixel.
static inline Mask outside(const Scene& scene, const View& view, size_t first, int count) {
  Projection c;
  const Three mean = triples(scene.means, first, count);
  const Three log_scales = triples(scene.log_scales, first, count);
  Whole finite = finite_bits(all(0));
  for (int k = 0; k < 3; k++) finite &= finite_bits(mean[k]) & finite_bits(log_scales[k]);
  const Lanes log_scale = max(log_scales[0], max(log_scales[1], log_scales[2]));
  to_camera(c, mean, view);
  const Lanes scale = exp(clamp(log_scale, -LOG_SCALE_MAX * 1.5f, LOG_SCALE_MAX)), ss = scale * scale;
  const Lanes half_x = SLACK * sqrt(REACH * (ss * dot(c.u, c.u) + view.dilation)) + ROUNDING;
  const Lanes half_y = SLACK * sqrt(REACH * (ss * dot(c.v, c.v) + view.dilation)) + ROUNDING;
  const Lanes x = view.fx * c.slope_x + view.cx, y = view.fy * c.slope_y + view.cy;
  const Mask out = below(c.z, all(view.orthographic ? 1e-30f : view.near)) | below(x + half_x, all(0.5f)) |
                   below(all(view.width - 0.5f), x - half_x) | below(y + half_y, all(0.5f)) |
                   below(all(view.height - 0.5f), y - half_y);
  return out & mask_of(finite);
}

void cull(const Scene& scene, const View& view, uint32_t* rows, uint32_t* counts, int threads) {
  const ptrdiff_t chunks = (scene.n + CHUNK - 1) / CHUNK;
#pragma omp parallel for num_threads(threads) schedule(static)
  for (ptrdiff_t chunk = 0; chunk < chunks; chunk++) {
    const size_t begin = chunk * CHUNK, end = begin + CHUNK < scene.n ? begin + CHUNK : scene.n;
    uint32_t* to = rows + begin;
    for (size_t i = begin; i < end; i += LANES) {
      const int count = end - i < LANES ? end - i : LANES;
      const Mask out = outside(scene, view, i, count);
      const Lanes in = select(out, all(0), all(1));
      for (int l = 0; l < count; l++) {
        *to = uint32_t(i + l);  // a later one overwrites it if this one is out
        to += in[l] > 0;
      }
    }
    counts[chunk] = to - (rows + begin);
  }
}

}  // namespace ISA
}  // namespace raster
