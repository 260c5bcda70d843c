#include "bin.h"
#include <algorithm>
#include <cmath>
#include <cstring>
#include <omp.h>
#include <stdexcept>

namespace raster {

namespace {

constexpr size_t FEW = 1 << 16;  // keys below which a second thread costs more than it brings

constexpr float FLAT = 1e-16f;  // a conic below this is constant over any picture, and its ratios mean nothing

int clamped_floor(float v, int low, int high) {  // NaN gives low
  v = std::min(float(high), std::max(float(low), v));
  const int truncated = int(v);
  return truncated - (v < truncated);
}

// Calls f(tile) for every tile with a pixel centre inside the ellipse alpha >= ALPHA_MIN, row of tiles by row.
// Within a row, the ellipse's x at height dy are skew dy +- sqrt((reach - flat dy^2) / -xx); over an interval of dy
// the extremes lie at its ends or at the ellipse's own rightmost and leftmost points.
template <class F> void each_tile(const Splat& s, int columns, F f) {
  const int left = s.left / TILE, right = s.right / TILE, top = s.top / TILE, bottom = s.bottom / TILE;
  if (left == right || top == bottom || s.xx > -FLAT || s.yy > -FLAT) {
    for (int row = top; row <= bottom; row++)
      for (int column = left; column <= right; column++) f(row * columns + column);
    return;
  }
  const float reach = s.log2_opacity + LOG2_255, per_xx = -1 / s.xx;
  const float skew = 0.5f * s.xy * per_xx;
  const float flat = -s.yy - 0.25f * s.xy * s.xy * per_xx;
  const float rightmost = s.half_x * s.xy / (-2 * s.yy);  // its dy; the leftmost point's is the negative
  for (int row = top; row <= bottom; row++) {
    const float from = std::max(row * TILE + 0.5f - s.y, -s.half_y);
    const float to = std::min(row * TILE + (TILE - 0.5f) - s.y, s.half_y);
    const float wide_from = std::sqrt(std::max(0.f, (reach - flat * from * from) * per_xx));
    const float wide_to = std::sqrt(std::max(0.f, (reach - flat * to * to) * per_xx));
    float high = std::max(skew * from + wide_from, skew * to + wide_to);
    float low = std::min(skew * from - wide_from, skew * to - wide_to);
    if (rightmost >= from && rightmost <= to) high = s.half_x;
    if (-rightmost >= from && -rightmost <= to) low = -s.half_x;
    // pixel centres from s.x + low to s.x + high
    const int first = std::max(left, -clamped_floor(0.5f - s.x - low, -columns * TILE, 0) / TILE);
    const int beyond = (clamped_floor(s.x + high + 0.5f, 0, columns * TILE) + TILE - 1) / TILE;
    for (int column = first; column <= right && column < beyond; column++) f(row * columns + column);
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

// Slots of every splat, and a key for each that has any.
void Binning::count(const Splat* splats, size_t n, int threads) {
  slots_.resize(n + 1);
  slots_[0] = 0;
#pragma omp parallel for num_threads(threads) schedule(static)
  for (ptrdiff_t i = 0; i < ptrdiff_t(n); i++) {
    uint32_t found = 0;
    if (splats[i].visible()) each_tile(splats[i], columns_, [&](int) { found++; });
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

// Radix sort by depth, 11 bits at a time: stable, so splats of equal depth keep their order.
void Binning::order_by_depth(int threads) {
  constexpr int BITS = 11, DIGITS = 1 << BITS;
  const size_t n = keys_.size();
  if (n < FEW) threads = 1;
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

// Front to back, every splat goes to the end of the lists of its tiles: a counting sort by tile, stable again.
void Binning::distribute(const Splat* splats, int threads) {
  const size_t n = slots_.size() - 1, visible = keys_.size(), tiles = size_t(columns_) * rows_;
  const size_t total = slots_[n];
  tile_of_slot_.resize(total);
  splat_.resize(total);
  slot_.resize(total);
  blocks_.resize(total);
  first_.resize(tiles + 1);
#pragma omp parallel for num_threads(threads) schedule(static)
  for (ptrdiff_t i = 0; i < ptrdiff_t(n); i++)
    if (slots_[i + 1] > slots_[i]) {
      uint32_t* to = &tile_of_slot_[slots_[i]];
      each_tile(splats[i], columns_, [&](int tile) { *to++ = uint32_t(tile); });
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
        splat_[place] = g;
        slot_[place] = slot;
      }
    }
  }
}

}  // namespace raster
