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
constexpr int PREFETCH_AHEAD = 6;  // splats between the blended one and the prefetched one
constexpr int CHECK_EVERY = 16;  // splats between two checks which blocks are still alive

typedef uint64_t Blocks;  // a bit for each
static_assert(BLOCKS <= 64, "a bit for each");

struct TileFrame {
  int left, top;  // pixels
  const Images& images;
  Lanes x[BLOCKS_ACROSS], y[BLOCKS_DOWN];  // pixel centres from the tile's corner

  TileFrame(int tile, const Tiles& tiles, const Images& of)
      : left(tile % tiles.columns * TILE), top(tile / tiles.columns * TILE), images(of) {
    for (int c = 0; c < BLOCKS_ACROSS; c++)
      for (int l = 0; l < LANES; l++) x[c][l] = c * BLOCK_WIDTH + l % BLOCK_WIDTH + 0.5f;
    for (int r = 0; r < BLOCKS_DOWN; r++)
      for (int l = 0; l < LANES; l++) y[r][l] = r * BLOCK_HEIGHT + l / BLOCK_WIDTH + 0.5f;
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
static inline Blocks blocks_met(const TileFrame& frame, const Splat& s) {
  const int left = clamp_to_tile(s.left - frame.left) / BLOCK_WIDTH;
  const int right = clamp_to_tile(s.right - frame.left) / BLOCK_WIDTH;
  const int top = clamp_to_tile(s.top - frame.top) / BLOCK_HEIGHT;
  const int bottom = clamp_to_tile(s.bottom - frame.top) / BLOCK_HEIGHT;
  constexpr Blocks FIRST_COLUMN = ~Blocks(0) / ((Blocks(1) << BLOCKS_ACROSS) - 1);  // a bit every BLOCKS_ACROSS
  const Blocks columns = (lowest(right + 1) & ~lowest(left)) * FIRST_COLUMN;
  return columns & lowest((bottom + 1) * BLOCKS_ACROSS) & ~lowest(top * BLOCKS_ACROSS);
}

// A splat relative to one tile, its values in all lanes.
struct TileSplat {
  Lanes x, y, xx, xy, yy, log2_opacity;
  TileSplat(const TileFrame& frame, const Splat& s)
      : x(all(s.x - frame.left)), y(all(s.y - frame.top)), xx(all(s.xx)), xy(all(s.xy)), yy(all(s.yy)),
        log2_opacity(all(s.log2_opacity)) {}
};

// A splat blended over one block: the pixels that take it (`on`), its alpha there, its blend weight (0 elsewhere).
struct BlendSample {
  Lanes dx, dy, alpha, weight;
  Mask on, unclamped;
};

// Blends a splat over a block. A fifth of the blocks are not reached (a corner of the splat's box), but a branch that
// skips them is mispredicted too often to pay.
static inline void blend_block(const TileFrame& frame, const TileSplat& s, int block, Lanes& transmittance,
                               BlendSample& t) {
  t.dx = frame.x[block % BLOCKS_ACROSS] - s.x;
  t.dy = frame.y[block / BLOCKS_ACROSS] - s.y;
  const Lanes log2_alpha = (s.xx * t.dx + s.xy * t.dy) * t.dx + (s.yy * t.dy * t.dy + s.log2_opacity);
  const Mask reached = at_least(log2_alpha, all(-LOG2_255));
  const Lanes clear = transmittance;
  const Lanes alpha = exp2(clamp(log2_alpha, -8, 0));  // above 0 only by cancellation, far out along a needle
  t.unclamped = below(alpha, all(ALPHA_MAX));
  t.alpha = min(alpha, all(ALPHA_MAX));
  const Lanes weight = t.alpha * clear, rest = clear - weight;
  t.on = reached & at_least(rest, all(CLEAR_MIN));  // never a saturated pixel: its rest is negative
  t.weight = where(t.on, weight);
  transmittance = select(t.on, rest, select(reached, negative(clear), clear));
}

// Goes over a tile's splats from front to back: at(place, splat, blocks) for each, with the blocks that it meets, then
// skip(place) for the rest once all pixels are saturated.
template <class At, class Skip>
static inline void for_each_splat(const TileFrame& frame, const Splat* splats, const Tiles& tiles, int tile,
                                  const Lanes* transmittance, At at, Skip skip) {
  const uint32_t end = tiles.first[tile + 1];
  uint32_t place = tiles.first[tile];
  Blocks alive = alive_blocks(transmittance, lowest(BLOCKS));
  for (int count = 1; place < end && alive; place++, count++) {
    const uint32_t ahead = place + PREFETCH_AHEAD < end ? place + PREFETCH_AHEAD : end - 1;
    __builtin_prefetch(&splats[tiles.splat[ahead]]);
    const Splat& s = splats[tiles.splat[place]];
    at(place, s, blocks_met(frame, s) & alive);
    if (count % CHECK_EVERY == 0) alive = alive_blocks(transmittance, alive);
  }
  for (; place < end; place++) skip(place);
}

}  // namespace ISA
}  // namespace raster
