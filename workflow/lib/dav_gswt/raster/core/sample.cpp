#include "sample.h"
#include <algorithm>

namespace raster {

namespace {

constexpr size_t CHUNK_POINTS = 1024;
constexpr float NEAREST = 1e-6f;

void add_point(const Photo& p, float x, float y, float z, float* total, float* squares, float* count) {
  if (!(z > NEAREST)) return;
  const float per_z = 1 / z, u = p.fx * x * per_z + (p.cx - 0.5f), v = p.fy * y * per_z + (p.cy - 0.5f);
  if (!(u >= 0 && v >= 0 && u < float(p.width - 1) && v < float(p.height - 1))) return;
  const int column = int(u), row = int(v);
  const size_t at = size_t(row) * p.width + column;
  if (!(p.weight[at] > 0)) return;
  const float right = u - float(column), down = v - float(row);
  const float *top = p.image + 3 * at, *bottom = top + 3 * size_t(p.width);
  float square = 0;
  for (int c = 0; c < 3; c++) {
    const float above = top[c] * (1 - right) + top[c + 3] * right;
    const float below = bottom[c] * (1 - right) + bottom[c + 3] * right;
    const float colour = above * (1 - down) + below * down;
    total[c] += colour;
    square += colour * colour;
  }
  *squares += square;
  *count += 1;
}

}  // namespace

void add_colours(const Photo& photo, const float* points, size_t n, const float* heights, size_t m,
                 const ColourSums& sums, int threads) {
  const float *r = photo.rotation, *t = photo.translation;
  const ptrdiff_t chunks = ptrdiff_t((n + CHUNK_POINTS - 1) / CHUNK_POINTS);
#pragma omp parallel for num_threads(threads) schedule(static)
  for (ptrdiff_t chunk = 0; chunk < chunks; chunk++) {
    const size_t begin = size_t(chunk) * CHUNK_POINTS, end = std::min(n, begin + CHUNK_POINTS);
    float seen[3 * CHUNK_POINTS];
    for (size_t i = begin; i < end; i++) {
      const float* p = points + 3 * i;
      for (int c = 0; c < 3; c++)
        seen[3 * (i - begin) + c] = r[3 * c] * p[0] + r[3 * c + 1] * p[1] + r[3 * c + 2] * p[2] + t[c];
    }
    for (size_t k = 0; k < m; k++) {
      const float dx = heights[k] * r[2], dy = heights[k] * r[5], dz = heights[k] * r[8];
      for (size_t i = begin; i < end; i++) {
        const float* q = seen + 3 * (i - begin);
        const size_t to = k * n + i;
        add_point(photo, q[0] + dx, q[1] + dy, q[2] + dz, sums.total + 3 * to, sums.squares + to, sums.count + to);
      }
    }
  }
}

}  // namespace raster
