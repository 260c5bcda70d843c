#include "bin.h"
#include <algorithm>
#include <cmath>
#include <cstring>
#include <omp.h>
#include <stdexcept>

namespace raster {

namespace {

constexpr float FLAT = 1e-16f;  // a conic below this is constant over any picture, and its ratios mean nothing

int clamped_floor(float v, int low, int high) {  // NaN gives low
  v = std::min(float(high), std::max(float(low), v));
  const int truncated = int(v);
  return truncated - (v < truncated);
}

// Pixel centres from `from` to `to`, as first and last tile of `count`; none if first > last.
struct Range {
  int first, last;
  Range(float from, float to, int count) {
    const int first_pixel = -clamped_floor(0.5f - from, -count * TILE, 0);
    const int last_pixel = clamped_floor(to - 0.5f, -1, count * TILE - 1);
    const bool none = first_pixel > last_pixel;
    first = none ? 1 : first_pixel / TILE;
    last = none ? 0 : last_pixel / TILE;
  }
};

// Calls f(tile) for every tile with a pixel centre inside the ellipse alpha >= ALPHA_MIN, row of tiles by row.
// Within a row, the ellipse's x at height dy are skew dy +- sqrt((reach - flat dy^2) / -xx); over an interval of dy
// the extremes lie at its ends or at the ellipse's own rightmost and leftmost points.
template <class F> void each_tile(const Splat& s, int columns, int rows, F f) {
  const Range down(s.y - s.half_y, s.y + s.half_y, rows);
  const Range across(s.x - s.half_x, s.x + s.half_x, columns);
  if (across.first > across.last) return;
  if (down.first == down.last || across.first == across.last || s.xx > -FLAT || s.yy > -FLAT) {
    for (int row = down.first; row <= down.last; row++)
      for (int column = across.first; column <= across.last; column++) f(row * columns + column);
    return;
  }
  const float reach = s.log2_opacity + LOG2_255, per_xx = -1 / s.xx;
  const float skew = 0.5f * s.xy * per_xx;
  const float flat = -s.yy - 0.25f * s.xy * s.xy * per_xx;
  const float rightmost = s.half_x * s.xy / (-2 * s.yy);  // its dy; the leftmost point's is the negative
  for (int row = down.first; row <= down.last; row++) {
    const float from = std::max(row * TILE + 0.5f - s.y, -s.half_y);
    const float to = std::min(row * TILE + (TILE - 0.5f) - s.y, s.half_y);
    const float wide_from = std::sqrt(std::max(0.f, (reach - flat * from * from) * per_xx));
    const float wide_to = std::sqrt(std::max(0.f, (reach - flat * to * to) * per_xx));
    float right = std::max(skew * from + wide_from, skew * to + wide_to);
    float left = std::min(skew * from - wide_from, skew * to - wide_to);
    if (rightmost >= from && rightmost <= to) right = s.half_x;
    if (-rightmost >= from && -rightmost <= to) left = -s.half_x;
    const Range within(s.x + left, s.x + right, columns);
    for (int column = within.first; column <= within.last; column++) f(row * columns + column);
  }
}

}  // namespace

void Binning::sort(const Splat* splats, size_t n, int width, int height, int threads) {
  columns_ = (width + TILE - 1) / TILE;
  rows_ = (height + TILE - 1) / TILE;
  count(splats, n, threads);
  order_by_depth(threads);
  distribute(splats, threads);
}

// Slots of every Gaussian, and a key for each that has any.
void Binning::count(const Splat* splats, size_t n, int threads) {
  slots_.resize(n + 1);
  slots_[0] = 0;
#pragma omp parallel for num_threads(threads) schedule(static)
  for (ptrdiff_t i = 0; i < ptrdiff_t(n); i++) {
    uint32_t found = 0;
    if (splats[i].half_y >= 0) each_tile(splats[i], columns_, rows_, [&](int) { found++; });
    slots_[i + 1] = found;
  }
  keys_.clear();
  uint64_t total = 0;
  for (size_t i = 0; i < n; i++) {
    if (slots_[i + 1]) {
      uint32_t depth;  // a positive float's bits order like the float
      std::memcpy(&depth, &splats[i].depth, 4);
      keys_.push_back(uint64_t(depth) << 32 | i);
    }
    total += slots_[i + 1];
    if (total > INT32_MAX) throw std::length_error("more than 2^31 splats over all tiles");
    slots_[i + 1] = uint32_t(total);
  }
}

// Radix sort by depth, 11 bits at a time: stable, so Gaussians of equal depth keep their order.
void Binning::order_by_depth(int threads) {
  constexpr int BITS = 11, DIGITS = 1 << BITS;
  const size_t n = keys_.size();
  spare_keys_.resize(n);
  histogram_.resize(size_t(threads) * DIGITS);
  for (int shift = 32; shift < 64; shift += BITS) {
    std::fill(histogram_.begin(), histogram_.end(), 0);
#pragma omp parallel num_threads(threads)
    {
      const size_t me = omp_get_thread_num(), team = omp_get_num_threads();
      const size_t begin = n * me / team, end = n * (me + 1) / team;
      uint32_t* next = &histogram_[me * DIGITS];
      for (size_t i = begin; i < end; i++) next[keys_[i] >> shift & (DIGITS - 1)]++;
#pragma omp barrier
#pragma omp single
      {
        uint32_t at = 0;
        for (int digit = 0; digit < DIGITS; digit++)
          for (size_t t = 0; t < team; t++) {
            uint32_t& slot = histogram_[t * DIGITS + digit];
            const uint32_t here = slot;
            slot = at;
            at += here;
          }
      }
      for (size_t i = begin; i < end; i++) spare_keys_[next[keys_[i] >> shift & (DIGITS - 1)]++] = keys_[i];
    }
    keys_.swap(spare_keys_);
  }
}

// Front to back, every Gaussian goes to the end of the lists of its tiles: a counting sort by tile, stable again.
void Binning::distribute(const Splat* splats, int threads) {
  const size_t n = slots_.size() - 1, visible = keys_.size(), tiles = size_t(columns_) * rows_;
  const size_t total = slots_[n];
  tile_of_slot_.resize(total);
  gaussian_.resize(total);
  slot_.resize(total);
  first_.resize(tiles + 1);
#pragma omp parallel for num_threads(threads) schedule(static)
  for (ptrdiff_t i = 0; i < ptrdiff_t(n); i++)
    if (slots_[i + 1] > slots_[i]) {
      uint32_t* to = &tile_of_slot_[slots_[i]];
      each_tile(splats[i], columns_, rows_, [&](int tile) { *to++ = uint32_t(tile); });
    }
  histogram_.assign(size_t(threads) * tiles, 0);
#pragma omp parallel num_threads(threads)
  {
    const size_t me = omp_get_thread_num(), team = omp_get_num_threads();
    const size_t begin = visible * me / team, end = visible * (me + 1) / team;
    uint32_t* next = &histogram_[me * tiles];
    for (size_t i = begin; i < end; i++) {
      const uint32_t g = uint32_t(keys_[i]);
      for (uint32_t slot = slots_[g]; slot < slots_[g + 1]; slot++) next[tile_of_slot_[slot]]++;
    }
#pragma omp barrier
#pragma omp single
    {
      uint32_t at = 0;
      for (size_t tile = 0; tile < tiles; tile++) {
        first_[tile] = at;
        for (size_t t = 0; t < team; t++) {
          uint32_t& place = histogram_[t * tiles + tile];
          const uint32_t here = place;
          place = at;
          at += here;
        }
      }
      first_[tiles] = at;
    }
    for (size_t i = begin; i < end; i++) {
      const uint32_t g = uint32_t(keys_[i]);
      for (uint32_t slot = slots_[g]; slot < slots_[g + 1]; slot++) {
        const uint32_t place = next[tile_of_slot_[slot]]++;
        gaussian_[place] = g;
        slot_[place] = slot;
      }
    }
  }
}

}  // namespace raster
