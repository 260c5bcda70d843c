// (1 - structure) L1 + structure (1 - SSIM), both weighted per pixel, with the gradient of the image.
//
// Local means are taken by the usual 11-tap Gaussian (sigma 1.5) over the pixels that count: with weights w,
// mean of f at q = sum_p g(p - q) w_p f_p / sum_p g(p - q) w_p; beyond the border w = 0. So
// loss = 1/N sum_q w_q [(1 - structure) |x_q - y_q| + structure (1 - SSIM_q)], N = height width channels.
// Rows are taken as plain floats, channels interleaved: a step of one pixel is a step of `channels` floats.
#include "kernels.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

namespace raster {
namespace ISA {

constexpr int RADIUS = 5, PLANES = 6;  // local sums of w, wx, wy, wxx, wyy, wxy
constexpr float C1 = 1e-4f, C2 = 9e-4f;

struct Taps { float at[RADIUS + 1]; };  // by distance

static Taps gaussian() {
  Taps t;
  float sum = 0;
  for (int i = 0; i <= RADIUS; i++) t.at[i] = expf(-i * i / 4.5f), sum += (i ? 2 : 1) * t.at[i];
  for (float& v : t.at) v /= sum;
  return t;
}

// Rows with a border of zeros as wide as the filter reaches.
struct Rows {
  float* data;
  int length, border, stride;
  Rows(int count, int floats, int channels)
      : length(floats), border(RADIUS * channels), stride(floats + 2 * RADIUS * channels) {
    data = (float*)calloc((size_t)count * stride, 4);
  }
  ~Rows() { free(data); }
  float* row(int i) { return data + (size_t)i * stride + border; }
};

static inline void blur_row(const Taps& t, const float* __restrict from, float* __restrict to, int length, int step) {
  const float k0 = t.at[0], k1 = t.at[1], k2 = t.at[2], k3 = t.at[3], k4 = t.at[4], k5 = t.at[5];
#pragma omp simd
  for (int i = 0; i < length; i++)
    to[i] = k0 * from[i] + k1 * (from[i - step] + from[i + step]) + k2 * (from[i - 2 * step] + from[i + 2 * step]) +
            k3 * (from[i - 3 * step] + from[i + 3 * step]) + k4 * (from[i - 4 * step] + from[i + 4 * step]) +
            k5 * (from[i - 5 * step] + from[i + 5 * step]);
}

// Vertical sums around row y, straight from the images: products cost less than planes of them.
static void sum_down(const LossTask& task, const Taps& t, int y, Rows& sums, float* wide) {
  const int length = sums.length, channels = task.channels;
  float *__restrict w0 = sums.row(0), *__restrict x1 = sums.row(1), *__restrict y1 = sums.row(2);
  float *__restrict xx = sums.row(3), *__restrict yy = sums.row(4), *__restrict xy = sums.row(5);
  for (int p = 0; p < PLANES; p++) memset(sums.row(p), 0, 4 * (size_t)length);
  for (int j = -RADIUS; j <= RADIUS; j++) {
    if (y + j < 0 || y + j >= task.height) continue;
    const float k = t.at[j < 0 ? -j : j];
    const float* __restrict a = task.image + (size_t)(y + j) * length;
    const float* __restrict b = task.target + (size_t)(y + j) * length;
    if (task.weight) {
      const float* weight = task.weight + (size_t)(y + j) * task.width;
      for (int x = 0; x < task.width; x++)
        for (int c = 0; c < channels; c++) wide[x * channels + c] = weight[x];
    }
    const float* __restrict w = wide;
#pragma omp simd
    for (int i = 0; i < length; i++) {
      const float kw = k * w[i], ka = kw * a[i], kb = kw * b[i];
      w0[i] += kw, x1[i] += ka, y1[i] += kb;
      xx[i] += ka * a[i], yy[i] += kb * b[i], xy[i] += ka * b[i];
    }
  }
}

// SSIM at one row from local sums, and its derivatives by the local means of x, xx and xy, each over the local sum
// of weights. Returns sum of w (1 - SSIM).
static float compare(int length, const float* __restrict w, Rows& sums, float* __restrict d1, float* __restrict d2,
                     float* __restrict d3) {
  const float *__restrict n = sums.row(0), *__restrict sx = sums.row(1), *__restrict sy = sums.row(2);
  const float *__restrict sxx = sums.row(3), *__restrict syy = sums.row(4), *__restrict sxy = sums.row(5);
  float total = 0;
#pragma omp simd reduction(+ : total)
  for (int i = 0; i < length; i++) {
    const float per_n = n[i] > 0 ? 1.f / n[i] : 0.f;
    const float a = sx[i] * per_n, b = sy[i] * per_n;
    const float vaa = sxx[i] * per_n - a * a, vbb = syy[i] * per_n - b * b, vab = sxy[i] * per_n - a * b;
    const float mean = 2 * a * b + C1, cross = 2 * vab + C2;
    const float per_means = 1.f / (a * a + b * b + C1), per_spread = 1.f / (vaa + vbb + C2);
    const float per_both = per_means * per_spread, ssim = mean * cross * per_both;
    const float scale = w[i] * per_n;
    total += w[i] * (1 - ssim);
    d1[i] = scale * 2 * (b * (cross - mean) * per_both - a * ssim * (per_means - per_spread));
    d2[i] = -scale * ssim * per_spread;
    d3[i] = scale * 2 * mean * per_both;
  }
  return total;
}

static void wide_weights(const LossTask& task, int y, float* wide) {
  if (!task.weight) return;
  for (int x = 0; x < task.width; x++)
    for (int c = 0; c < task.channels; c++) wide[x * task.channels + c] = task.weight[(size_t)y * task.width + x];
}

// The gradient of one row, and sum of w |x - y|.
static float descend(const LossTask& task, const Taps& t, int y, const float* w, Rows& sums, Rows& blurred) {
  const int length = sums.length;
  const size_t plane = (size_t)task.height * length;
  for (int p = 0; p < 3; p++) {
    float* __restrict sum = sums.row(p);
    memset(sum, 0, 4 * (size_t)length);
    for (int j = -RADIUS; j <= RADIUS; j++) {
      if (y + j < 0 || y + j >= task.height) continue;
      const float k = t.at[j < 0 ? -j : j];
      const float* __restrict from = task.scratch + p * plane + (size_t)(y + j) * length;
#pragma omp simd
      for (int i = 0; i < length; i++) sum[i] += k * from[i];
    }
    blur_row(t, sum, blurred.row(p), length, task.channels);
  }
  const float *__restrict d1 = blurred.row(0), *__restrict d2 = blurred.row(1), *__restrict d3 = blurred.row(2);
  const float* __restrict a = task.image + (size_t)y * length;
  const float* __restrict b = task.target + (size_t)y * length;
  float* __restrict out = task.gradient + (size_t)y * length;
  const float per_n = 1.f / plane, structure = task.structure * per_n, plain = per_n - structure;
  float total = 0;
#pragma omp simd reduction(+ : total)
  for (int i = 0; i < length; i++) {
    const float e = a[i] - b[i];
    total += w[i] * __builtin_fabsf(e);
    const float sign = e > 0 ? 1.f : e < 0 ? -1.f : 0.f;
    out[i] = w[i] * (plain * sign - structure * (d1[i] + 2 * a[i] * d2[i] + b[i] * d3[i]));
  }
  return total;
}

void loss(const LossTask& task, int threads) {
  const Taps taps = gaussian();
  const int length = task.width * task.channels;
  const size_t plane = (size_t)task.height * length;
#pragma omp parallel num_threads(threads)
  {
    Rows sums(PLANES, length, task.channels), blurred(PLANES, length, task.channels), weights(1, length, 0);
    float* wide = weights.row(0);
    for (int i = 0; i < length; i++) wide[i] = 1;
#pragma omp for schedule(static)
    for (int y = 0; y < task.height; y++) {
      sum_down(task, taps, y, sums, wide);
      for (int p = 0; p < PLANES; p++) blur_row(taps, sums.row(p), blurred.row(p), length, task.channels);
      wide_weights(task, y, wide);
      float* to = task.scratch + (size_t)y * length;
      task.row_sums[y] = task.structure * compare(length, wide, blurred, to, to + plane, to + 2 * plane);
    }
#pragma omp for schedule(static)
    for (int y = 0; y < task.height; y++) {
      wide_weights(task, y, wide);
      task.row_sums[y] += (1 - task.structure) * descend(task, taps, y, wide, sums, blurred);
    }
  }
}

}  // namespace ISA
}  // namespace raster
