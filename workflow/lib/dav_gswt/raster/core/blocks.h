// The layout of a tile's pixels in lanes, and the loop over a tile's splats that the blending kernels share.
//
// A tile consists of blocks of LANES pixels, nearly square: a small splat fills more of their lanes than of a row's.
// A saturated pixel (its transmittance is used up) keeps it with a negative sign and takes no more splats.
#pragma once
#include "lanes.h"

namespace raster {
namespace ISA {

constexpr int BLOCK_WIDTH = LANES >= 16 ? 4 : LANES >= 8 ? 4 : 2;
constexpr int BLOCK_HEIGHT = LANES / BLOCK_WIDTH;
constexpr int BLOCKS_ACROSS = TILE / BLOCK_WIDTH;
constexpr int BLOCKS_DOWN = TILE / BLOCK_HEIGHT;
constexpr int BLOCKS = BLOCKS_ACROSS * BLOCKS_DOWN;
constexpr int ROWS_AT_ONCE = LANES < BLOCKS_DOWN ? LANES : BLOCKS_DOWN;  // of blocks: their bits fill at most 32
constexpr int WORDS = BLOCKS_DOWN / ROWS_AT_ONCE;
constexpr int BATCH = 16;  // splats between two checks which blocks are still alive
constexpr int PREFETCH_AHEAD = 6;  // splats between the blended one and the prefetched one
constexpr float LARGEST = 1e4f;  // half side of a box, in pixels: beyond it float32 loses the ellipse's pixels

typedef uint64_t Blocks;  // a bit for each
static_assert(BLOCKS <= 64, "a bit for each");

struct TileFrame {
  int left, top;  // pixels
  const Images& images;
  Lanes x[BLOCKS_ACROSS], y[BLOCKS_DOWN];  // pixel centres from the tile's corner
  Lanes first_row[WORDS], last_row[WORDS];  // y of the first and last pixels of each row of blocks, a row a lane
  Whole row_shift;  // where a row's bits begin

  TileFrame(int tile, const Tiles& tiles, const Images& of)
      : left(tile % tiles.columns * TILE), top(tile / tiles.columns * TILE), images(of) {
    for (int c = 0; c < BLOCKS_ACROSS; c++)
      for (int l = 0; l < LANES; l++) x[c][l] = c * BLOCK_WIDTH + l % BLOCK_WIDTH + 0.5f;
    for (int r = 0; r < BLOCKS_DOWN; r++)
      for (int l = 0; l < LANES; l++) y[r][l] = r * BLOCK_HEIGHT + l / BLOCK_WIDTH + 0.5f;
    for (int l = 0; l < LANES; l++) {
      row_shift[l] = l < ROWS_AT_ONCE ? l * BLOCKS_ACROSS : 0;
      for (int w = 0; w < WORDS; w++) {
        first_row[w][l] = l < ROWS_AT_ONCE ? (w * ROWS_AT_ONCE + l) * BLOCK_HEIGHT + 0.5f : 1e9f;  // met by none
        last_row[w][l] = first_row[w][l] + (BLOCK_HEIGHT - 1);
      }
    }
  }

  // Calls f(block, lane, pixel) for every pixel of the tile that lies in the image.
  template <class F> void each_pixel(F f) const {
    const int width = images.width - left < TILE ? images.width - left : TILE;
    const int height = images.height - top < TILE ? images.height - top : TILE;
    for (int y = 0; y < height; y++)
      for (int x = 0; x < width; x++)
        f(y / BLOCK_HEIGHT * BLOCKS_ACROSS + x / BLOCK_WIDTH, y % BLOCK_HEIGHT * BLOCK_WIDTH + x % BLOCK_WIDTH,
          (size_t)(top + y) * images.width + left + x);
  }

  // 1 within the image; saturated outside of it.
  void clear(Lanes* transmittance) const {
    for (int b = 0; b < BLOCKS; b++) transmittance[b] = all(-1);
    each_pixel([&](int block, int lane, size_t) { transmittance[block][lane] = 1; });
  }
};

// The blocks that still have a pixel that is not saturated.
static inline Blocks alive_blocks(const Lanes* transmittance, Blocks among) {
  Blocks found = 0;
  for (Blocks left = among; left; left &= left - 1) {
    const int b = __builtin_ctzll(left);
    found |= Blocks(any(at_least(transmittance[b], all(0)))) << b;
  }
  return found;
}

static inline Blocks lowest(int count) { return count >= 64 ? ~Blocks(0) : (Blocks(1) << count) - 1; }

static inline int clamp_to_tile(int pixel) { return pixel < 0 ? 0 : pixel > TILE - 1 ? TILE - 1 : pixel; }

// The blocks that the splat's box meets. The box meets the tile, else the splat were not in its list.
static inline Blocks blocks_in_box(const TileFrame& frame, const Splat& s) {
  const int left = clamp_to_tile(s.left - frame.left) / BLOCK_WIDTH;
  const int right = clamp_to_tile(s.right - frame.left) / BLOCK_WIDTH;
  const int top = clamp_to_tile(s.top - frame.top) / BLOCK_HEIGHT;
  const int bottom = clamp_to_tile(s.bottom - frame.top) / BLOCK_HEIGHT;
  constexpr Blocks FIRST_COLUMN = ~Blocks(0) / ((Blocks(1) << BLOCKS_ACROSS) - 1);  // a bit every BLOCKS_ACROSS
  const Blocks columns = (lowest(right + 1) & ~lowest(left)) * FIRST_COLUMN;
  return columns & lowest((bottom + 1) * BLOCKS_ACROSS) & ~lowest(top * BLOCKS_ACROSS);
}

// The bits of all lanes together.
static inline uint32_t any_bits(Whole lanes) {
  uint64_t pairs[LANES / 2], bits = 0;
  memcpy(pairs, &lanes, sizeof lanes);
  for (int l = 0; l < LANES / 2; l++) bits |= pairs[l];
  return uint32_t(bits | bits >> 32);
}

// The blocks with a pixel centre within the splat's ellipse alpha >= ALPHA_MIN, and now and then one more: never one
// too few. In half sides of its box the ellipse's x at height t is r t +- sqrt((1 - r^2)(1 - t^2)), r: `correlation`;
// over an interval of t the extremes lie at its ends, or are +-1 where it holds +-r. A lane is a row of blocks.
static inline Blocks blocks_in_ellipse(const TileFrame& frame, const Splat& s) {
  constexpr float SLACK = 1e-6f, MARGIN = 1e-3f;  // for rounding: of squares, and in blocks
  const float r = s.correlation, per_y = 1 / s.half_y, wide = s.half_x * (1.f / BLOCK_WIDTH), y = s.y - frame.top;
  const Lanes narrow = all((1 - r) * (1 + r) + SLACK), middle = all((s.x - frame.left - 0.5f) * (1.f / BLOCK_WIDTH));
  Blocks found = 0;
  for (int word = 0; word < WORDS; word++) {
    const Lanes from = max((frame.first_row[word] - y) * per_y, all(-1));
    const Lanes to = min((frame.last_row[word] - y) * per_y, all(1));
    const Lanes wide_from = sqrt(max(narrow * (1.f - from * from) + SLACK, all(0)));
    const Lanes wide_to = sqrt(max(narrow * (1.f - to * to) + SLACK, all(0)));
    Lanes high = max(r * from + wide_from, r * to + wide_to), low = min(r * from - wide_from, r * to - wide_to);
    high = select(at_least(all(r), from) & at_least(to, all(r)), all(1), high);
    low = select(at_least(all(-r), from) & at_least(to, all(-r)), all(-1), low);
    // truncated: the first block with a pixel centre right of the low end, and the first one beyond the high end
    const Lanes first = clamp(middle + (wide * low + (1.f / BLOCK_WIDTH - MARGIN)), 0, BLOCKS_ACROSS);
    const Lanes beyond = clamp(middle + (wide * high + (1 + MARGIN)), 0, BLOCKS_ACROSS);
    const Whole one = Whole{} + 1;
    const Whole bits = (one << __builtin_convertvector(beyond, Whole)) - (one << __builtin_convertvector(first, Whole));
    const Whole rows = (bits & (Whole)(from <= to)) << frame.row_shift;
    found |= Blocks(any_bits(rows)) << (32 * word);
  }
  return found;
}

static inline Blocks blocks_met(const TileFrame& frame, const Splat& s) {
  return s.half_x < LARGEST && s.half_y < LARGEST ? blocks_in_ellipse(frame, s) : blocks_in_box(frame, s);
}

// A splat relative to one tile.
struct TileSplat {
  float x, y, xx, xy, yy, log2_opacity;
  TileSplat() = default;
  TileSplat(const TileFrame& frame, const Splat& s)
      : x(s.x - frame.left), y(s.y - frame.top), xx(s.xx), xy(s.xy), yy(s.yy), log2_opacity(s.log2_opacity) {}
};

// A batch of a tile's splats, and a pair for each block that one of them meets, splat by splat. The backward pass goes
// over the pairs once for each of its steps: in one loop they wait for each other, and its sums do not fit registers.
struct Batch {
  int count, pairs[BATCH + 1];  // splats, and where the pairs of each begin
  TileSplat splats[BATCH];
  uint8_t block[BATCH * BLOCKS], splat[BATCH * BLOCKS];
  Lanes alpha[BATCH * BLOCKS];  // 0 where it is below ALPHA_MIN
};

// Pixel centres of a block from a splat's centre.
static inline Lanes offset_x(const TileFrame& frame, const TileSplat& s, int block) {
  return frame.x[block % BLOCKS_ACROSS] - s.x;
}
static inline Lanes offset_y(const TileFrame& frame, const TileSplat& s, int block) {
  return frame.y[block / BLOCKS_ACROSS] - s.y;
}

// A splat's alpha at a block's pixels; 0 where it is below ALPHA_MIN.
static inline Lanes alpha_of(const TileFrame& frame, const TileSplat& s, int block) {
  const Lanes dx = offset_x(frame, s, block), dy = offset_y(frame, s, block);
  const Lanes log2_alpha = (s.xx * dx + s.xy * dy) * dx + (s.yy * dy * dy + s.log2_opacity);
  // above 0 only by cancellation, far out along a needle
  const Lanes alpha = min(exp2(clamp(log2_alpha, -8, 0)), all(ALPHA_MAX));
  return where(at_least(log2_alpha, all(-LOG2_255)), alpha);
}

// The pairs of a batch's splat number k with `blocks`.
static inline void add_pairs(const TileFrame& frame, Batch& batch, int k, Blocks blocks) {
  const TileSplat s = batch.splats[k];
  int pair = batch.pairs[k];
  for (; blocks; blocks &= blocks - 1, pair++) {
    const int b = __builtin_ctzll(blocks);
    batch.alpha[pair] = alpha_of(frame, s, b);
    batch.block[pair] = b;
    batch.splat[pair] = k;
  }
  batch.pairs[k + 1] = pair;
}

// Blends over a block: its blend weight, 0 for pixels that do not take it; transmittance becomes what is left.
static inline Lanes take(Lanes alpha, Lanes& transmittance) {
  const Lanes clear = transmittance, weight = alpha * clear, rest = clear - weight;
  const Mask on = at_least(rest, all(CLEAR_MIN));  // never a saturated pixel: its rest is negative
  transmittance = select(on, rest, negative(clear));
  return where(on, weight);
}

// Goes over a tile's splats from front to back: at(place, splat, blocks) with the alive blocks that each meets, until
// all pixels are saturated.
template <class At>
static inline void for_each_splat(const Splat* splats, const Tiles& tiles, int tile, const Lanes* transmittance,
                                  At at) {
  const uint32_t end = tiles.first[tile + 1];
  uint32_t place = tiles.first[tile];
  Blocks alive = alive_blocks(transmittance, lowest(BLOCKS));
  for (int count = 1; place < end && alive; place++, count++) {
    const uint32_t ahead = place + PREFETCH_AHEAD < end ? place + PREFETCH_AHEAD : end - 1;
    __builtin_prefetch(&splats[tiles.splat[ahead]]);
    at(place, splats[tiles.splat[place]], tiles.blocks[place] & alive);
    if (count % BATCH == 0) alive = alive_blocks(transmittance, alive);
  }
}

// The same a batch at a time: at(place, batch). Returns the place after the last splat.
template <class At>
static inline uint32_t for_each_batch(const TileFrame& frame, const Splat* splats, const Tiles& tiles, int tile,
                                      const Lanes* transmittance, At at) {
  const uint32_t end = tiles.first[tile + 1];
  uint32_t place = tiles.first[tile];
  Blocks alive = alive_blocks(transmittance, lowest(BLOCKS));
  Batch batch;
  batch.pairs[0] = 0;
  while (place < end && alive) {
    batch.count = end - place < (uint32_t)BATCH ? end - place : BATCH;
    for (int k = 0; k < batch.count; k++) {
      const uint32_t ahead = place + k + BATCH < end ? place + k + BATCH : end - 1;
      __builtin_prefetch(&splats[tiles.splat[ahead]]);
      batch.splats[k] = TileSplat(frame, splats[tiles.splat[place + k]]);
      add_pairs(frame, batch, k, tiles.blocks[place + k] & alive);
    }
    at(place, batch);
    place += batch.count;
    alive = alive_blocks(transmittance, alive);
  }
  return place;
}

}  // namespace ISA
}  // namespace raster
