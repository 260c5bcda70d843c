// Projects Gaussians to splats on the screen and evaluates the colours of the visible ones; LANES at a time.
#include "harmonics.h"
#include "kernels.h"

namespace raster {
namespace ISA {

// ceil(v) of a number within [0, 32767], as pixels
static inline Whole ceiling(Lanes v) {
  const Whole truncated = __builtin_convertvector(v, Whole);
  return truncated - (__builtin_convertvector(truncated, Lanes) < v);
}

// Writes the splats; returns which of them have a pixel.
static inline Mask store_splats(const Projection& c, const View& view, Splat* splats, int count) {
  const Lanes per_det = 1.f / c.det;
  const Lanes log2_opacity = log2(max(c.opacity * c.compensation, all(1e-37f)));
  const Lanes reach = 2 * LN2 * (log2_opacity + LOG2_255);  // the quadratic form at the rim
  const Lanes half_x = sqrt(max(reach * c.sxx, all(0))), half_y = sqrt(max(reach * c.syy, all(0)));
  const Lanes x = view.fx * c.slope_x + view.cx, y = view.fy * c.slope_y + view.cy;
  const Mask visible = at_least(c.z, all(view.orthographic ? 1e-30f : view.near)) & at_least(reach, all(0)) &
                       at_least(c.det, all(1e-30f));
  // the first pixel whose centre lies in the box, and the first beyond it
  const float width = view.width, height = view.height;
  const Lanes end_x = clamp(x + half_x - 0.5f, 0, width), end_y = clamp(y + half_y - 0.5f, 0, height);
  const Whole boxes[] = {ceiling(clamp(x - half_x - 0.5f, 0, width)), ceiling(clamp(y - half_y - 0.5f, 0, height)),
                         ceiling(select(visible, end_x, all(0))), ceiling(end_y)};
  const Lanes fields[] = {x,
                          y,
                          -0.5f * LOG2_E * (c.syy * per_det),
                          LOG2_E * (c.sxy * per_det),
                          -0.5f * LOG2_E * (c.sxx * per_det),
                          log2_opacity,
                          half_x,
                          half_y,
                          c.sxy / (sqrt(c.sxx) * sqrt(c.syy)),
                          c.z};
  float buffer[10][LANES];
  int box[4][LANES];
  for (int f = 0; f < 10; f++) store(buffer[f], fields[f]);
  memcpy(box, boxes, sizeof box);
  Whole has_pixel = {};
  for (int l = 0; l < count; l++) {
    Splat& s = splats[l];
    s.x = buffer[0][l], s.y = buffer[1][l];
    s.xx = buffer[2][l], s.xy = buffer[3][l], s.yy = buffer[4][l];
    s.log2_opacity = buffer[5][l];
    s.half_x = buffer[6][l], s.half_y = buffer[7][l];
    s.correlation = buffer[8][l];
    s.depth = buffer[9][l];
    const bool any_pixel = box[0][l] < box[2][l] && box[1][l] < box[3][l];
    has_pixel[l] = -(int)any_pixel;
    s.left = box[0][l], s.top = box[1][l];
    s.right = any_pixel ? box[2][l] - 1 : -1, s.bottom = any_pixel ? box[3][l] - 1 : -1;
  }
  return mask_of(has_pixel);
}

bool project(const Scene& scene, const View& view, const Candidates& candidates, Splat* splats, float* sh_colours,
             int threads) {
  const ptrdiff_t groups = (candidates.count + LANES - 1) / LANES;
  int invalid = 0;
#pragma omp parallel for num_threads(threads) schedule(static) reduction(| : invalid)
  for (ptrdiff_t g = 0; g < groups; g++) {
    const size_t first = g * LANES;
    const Rows rows(candidates, first);
    const Projection c = project_lanes(scene, view, rows);
    invalid |= !c.valid;
    const Mask visible = store_splats(c, view, splats + first, rows.count);
    if (!scene.coefficients || !any(visible)) continue;
    bool valid;
    const Three colour = shade(scene, view, rows, c.offset, visible, valid);
    invalid |= !valid;
    for (int k = 0; k < 3; k++) store_column(sh_colours + k, 3, first, rows.count, colour[k]);
  }
  return !invalid;
}

bool load_values(const Values& values, size_t count, int channel, int group, Splat* splats, int threads) {
  int invalid = 0;
#pragma omp parallel for num_threads(threads) schedule(static) reduction(| : invalid)
  for (ptrdiff_t i = 0; i < (ptrdiff_t)count; i++) {
    if (!splats[i].visible()) continue;
    const float* from = values.from + values.row(i) * values.channels + channel;
    float colour[GROUP] = {};
    for (int k = 0; k < group; k++) {
      colour[k] = from[k];
      invalid |= !__builtin_isfinite(from[k]);
    }
    memcpy(splats[i].colour, colour, sizeof colour);
  }
  return !invalid;
}

}  // namespace ISA
}  // namespace raster
