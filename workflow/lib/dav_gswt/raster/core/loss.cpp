// (1 - structure) L1 + structure (1 - SSIM), both weighted per pixel, with the gradient of the image.
//
// Local means are taken by the usual 11-tap Gaussian (sigma 1.5) over the pixels that count: with weights w,
// mean of f at q = sum_p g(p - q) w_p f_p / sum_p g(p - q) w_p; beyond the border w = 0. So
// loss = 1/N sum_q w_q [(1 - structure) |x_q - y_q| + structure (1 - SSIM_q)], N = height width channels.
//
// Rows are taken as plain floats, channels interleaved: a step of one pixel is a step of `channels` floats. Each pass
// goes down the columns first, straight from the images (products cost less than planes of them), into a few rows of
// sums, and along those rows second.
#include "kernels.h"
#include "lanes.h"
#include <math.h>
#include <stdlib.h>

namespace raster {
namespace ISA {

constexpr int RADIUS = 5, SUMS = 6, SLOPES = 3;
constexpr float C1 = 1e-4f, C2 = 9e-4f;

struct Taps {
  float at[RADIUS + 1];
};  // by distance

static Taps gaussian() {
  Taps t;
  float sum = 0;
  for (int i = 0; i <= RADIUS; i++) t.at[i] = expf(-i * i / 4.5f), sum += (i ? 2 : 1) * t.at[i];
  for (float& v : t.at) v /= sum;
  return t;
}

// Where things lie. Rows of planes are padded to whole vectors; the weights there are 0, and so is all that follows.
struct Layout {
  const LossTask& task;
  int length, stride;  // floats that count in a row, and from one to the next
  explicit Layout(const LossTask& t) : task(t), length(t.width * t.channels), stride(loss_stride(t)) {}
  float* slope(int which, int y) const { return task.scratch + ((size_t)which * task.height + y) * stride; }
  float* weight(int y) const { return slope(SLOPES, y); }
  const float* image(int y) const { return task.image + (size_t)y * length; }
  const float* target(int y) const { return task.target + (size_t)y * length; }
  int above(int y) const { return y < RADIUS ? -y : -RADIUS; }
  int below(int y) const { return task.height - 1 - y < RADIUS ? task.height - 1 - y : RADIUS; }
};

// Rows of sums of one thread, with a border of zeros as wide as the filter reaches.
struct Rows {
  float* data;
  int border, stride;
  Rows(int count, const Layout& in)
      : border(RADIUS * in.task.channels), stride(in.stride + 2 * RADIUS * in.task.channels) {
    data = (float*)calloc((size_t)count * stride, 4);
  }
  ~Rows() { free(data); }
  float* row(int i) { return data + (size_t)i * stride + border; }
};

static inline Lanes load_some(const float* from, int count) {
  if (count >= LANES) return load(from);
  float buffer[LANES] = {};
  memcpy(buffer, from, 4 * count);
  return load(buffer);
}

static inline void store_some(float* to, int count, Lanes v) { memcpy(to, &v, 4 * (count < LANES ? count : LANES)); }

static inline float sum_of(Lanes v) {
  float sum = 0;
  for (int l = 0; l < LANES; l++) sum += v[l];
  return sum;
}

static inline Lanes blurred(const Taps& t, const float* at, int step) {
  Lanes sum = t.at[0] * load(at);
  for (int k = 1; k <= RADIUS; k++) sum += t.at[k] * (load(at - k * step) + load(at + k * step));
  return sum;
}

static void spread_weights(const Layout& in, int y) {
  const int channels = in.task.channels;
  const float* weight = in.task.weight ? in.task.weight + (size_t)y * in.task.width : nullptr;
  float* to = in.weight(y);
  for (int i = in.length; i < in.stride; i++) to[i] = 0;
  for (int x = 0; x < in.task.width; x++)
    for (int c = 0; c < channels; c++) to[x * channels + c] = weight ? weight[x] : 1;
}

// Sums over the column of w, wx, wy, wxx, wyy, wxy.
static void sum_down(const Layout& in, const Taps& t, int y, Rows& sums) {
  for (int i = 0; i < in.length; i += LANES) {
    Lanes s[SUMS] = {};
    for (int j = in.above(y); j <= in.below(y); j++) {
      const Lanes a = load_some(in.image(y + j) + i, in.length - i), b = load_some(in.target(y + j) + i, in.length - i);
      const Lanes w = t.at[j < 0 ? -j : j] * load(in.weight(y + j) + i), wa = w * a, wb = w * b;
      s[0] += w, s[1] += wa, s[2] += wb;
      s[3] += wa * a, s[4] += wb * b, s[5] += wa * b;
    }
    for (int p = 0; p < SUMS; p++) store(sums.row(p) + i, s[p]);
  }
}

// SSIM along one row, and its slopes by the local means of x, xx and xy, each over the local sum of weights.
// Returns sum of w (1 - SSIM).
static float compare(const Layout& in, const Taps& t, int y, Rows& sums) {
  Lanes total = {};
  for (int i = 0; i < in.length; i += LANES) {
    Lanes m[SUMS];
    for (int p = 0; p < SUMS; p++) m[p] = blurred(t, sums.row(p) + i, in.task.channels);
    const Lanes w = load(in.weight(y) + i);
    const Lanes per_n = where(below(all(0), m[0]), 1.f / m[0]);
    const Lanes a = m[1] * per_n, b = m[2] * per_n;
    const Lanes vaa = m[3] * per_n - a * a, vbb = m[4] * per_n - b * b, vab = m[5] * per_n - a * b;
    const Lanes mean = 2 * a * b + C1, cross = 2 * vab + C2;
    const Lanes per_means = 1.f / (a * a + b * b + C1), per_spread = 1.f / (vaa + vbb + C2);
    const Lanes per_both = per_means * per_spread, ssim = mean * cross * per_both, scale = w * per_n;
    total += w * (1 - ssim);
    store(in.slope(0, y) + i, scale * 2 * (b * (cross - mean) * per_both - a * ssim * (per_means - per_spread)));
    store(in.slope(1, y) + i, -scale * ssim * per_spread);
    store(in.slope(2, y) + i, scale * 2 * mean * per_both);
  }
  return sum_of(total);
}

// The gradient along one row: the slopes go back to the pixels that their means were taken of.
// Returns sum of w |x - y|.
static float descend(const Layout& in, const Taps& t, int y, Rows& sums) {
  for (int i = 0; i < in.length; i += LANES) {
    Lanes s[SLOPES] = {};
    for (int j = in.above(y); j <= in.below(y); j++)
      for (int p = 0; p < SLOPES; p++) s[p] += t.at[j < 0 ? -j : j] * load(in.slope(p, y + j) + i);
    for (int p = 0; p < SLOPES; p++) store(sums.row(p) + i, s[p]);
  }
  const float per_n = 1.f / ((float)in.task.height * in.length), structure = in.task.structure * per_n;
  const float plain = per_n - structure;
  Lanes total = {};
  for (int i = 0; i < in.length; i += LANES) {
    const Lanes a = load_some(in.image(y) + i, in.length - i), b = load_some(in.target(y) + i, in.length - i);
    const Lanes w = load(in.weight(y) + i), e = a - b;
    total += w * max(e, -e);
    const Lanes sign = where(below(all(0), e), all(1)) - where(below(e, all(0)), all(1));
    Lanes d[SLOPES];
    for (int p = 0; p < SLOPES; p++) d[p] = blurred(t, sums.row(p) + i, in.task.channels);
    const Lanes gradient = w * (plain * sign - structure * (d[0] + 2 * a * d[1] + b * d[2]));
    store_some(in.task.gradient + (size_t)y * in.length + i, in.length - i, gradient);
  }
  return sum_of(total);
}

void loss(const LossTask& task, int threads) {
  const Taps taps = gaussian();
  const Layout in(task);
#pragma omp parallel num_threads(threads)
  {
    Rows sums(SUMS, in);
#pragma omp for schedule(static)
    for (int y = 0; y < task.height; y++) spread_weights(in, y);
#pragma omp for schedule(static)
    for (int y = 0; y < task.height; y++) {
      sum_down(in, taps, y, sums);
      task.row_sums[y] = task.structure * compare(in, taps, y, sums);
    }
#pragma omp for schedule(static)
    for (int y = 0; y < task.height; y++) task.row_sums[y] += (1 - task.structure) * descend(in, taps, y, sums);
  }
}

}  // namespace ISA
}  // namespace raster
