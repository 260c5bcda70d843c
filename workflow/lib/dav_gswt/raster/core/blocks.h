// How a tile's pixels lie in lanes, and the walk over a tile's splats that the blending kernels share.
//
// A tile is cut into blocks of LANES pixels, near squares: a small splat fills their lanes better than those of a row.
// A pixel whose transmittance is used up keeps it with the sign turned: it takes no more splats.
#pragma once
#include "lanes.h"

namespace raster {
namespace ISA {

constexpr int BLOCK_WIDTH = LANES >= 16 ? 4 : LANES >= 8 ? 4 : 2;
constexpr int BLOCK_HEIGHT = LANES / BLOCK_WIDTH;
constexpr int BLOCKS_ACROSS = TILE / BLOCK_WIDTH;
constexpr int BLOCKS_DOWN = TILE / BLOCK_HEIGHT;
constexpr int BLOCKS = BLOCKS_ACROSS * BLOCKS_DOWN;
constexpr int LOOK_AHEAD = 6;  // splats between the one that is blended and the one that is fetched
constexpr int ROLL_CALL = 16;  // splats between two looks at which blocks are still alive

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

  // 1 within the image; used up from the start outside of it.
  void clear(Lanes* transmittance) const {
    for (int b = 0; b < BLOCKS; b++) transmittance[b] = all(-1);
    each_pixel([&](int block, int lane, size_t) { transmittance[block][lane] = 1; });
  }
};

// Those blocks that still have a pixel which takes splats.
static inline Blocks living(const Lanes* transmittance, Blocks among) {
  Blocks found = 0;
  for (Blocks left = among; left; left &= left - 1) {
    const int b = __builtin_ctzll(left);
    found |= Blocks(any(at_least(transmittance[b], all(0)))) << b;
  }
  return found;
}

static inline Blocks lowest(int count) { return count >= 64 ? ~Blocks(0) : (Blocks(1) << count) - 1; }

static inline int within_tile(int pixel) { return pixel < 0 ? 0 : pixel > TILE - 1 ? TILE - 1 : pixel; }

// The blocks that the splat's box meets; it meets the tile, or would not be in its list.
static inline Blocks touched(const TileFrame& frame, const Splat& s) {
  const int left = within_tile(s.left - frame.left) / BLOCK_WIDTH;
  const int right = within_tile(s.right - frame.left) / BLOCK_WIDTH;
  const int top = within_tile(s.top - frame.top) / BLOCK_HEIGHT;
  const int bottom = within_tile(s.bottom - frame.top) / BLOCK_HEIGHT;
  constexpr Blocks FIRST_COLUMN = ~Blocks(0) / ((Blocks(1) << BLOCKS_ACROSS) - 1);  // a bit every BLOCKS_ACROSS
  const Blocks columns = (lowest(right + 1) & ~lowest(left)) * FIRST_COLUMN;
  return columns & lowest((bottom + 1) * BLOCKS_ACROSS) & ~lowest(top * BLOCKS_ACROSS);
}

// A splat, made ready for one tile.
struct Brush {
  Lanes x, y, xx, xy, yy, log2_opacity;
  Brush(const TileFrame& frame, const Splat& s)
      : x(all(s.x - frame.left)), y(all(s.y - frame.top)), xx(all(s.xx)), xy(all(s.xy)), yy(all(s.yy)),
        log2_opacity(all(s.log2_opacity)) {}
};

// What a splat does to a block: the pixels that take it (`on`), its alpha there, its blend weight (0 elsewhere).
struct Touch {
  Lanes dx, dy, alpha, weight;
  Mask on, unclamped;
};

// Lays a splat over a block. A fifth of the blocks are not reached at all (a corner of the splat's box), but a branch
// to leave them out is mispredicted too often to pay.
static inline void lay(const TileFrame& frame, const Brush& s, int block, Lanes& transmittance, Touch& t) {
  t.dx = frame.x[block % BLOCKS_ACROSS] - s.x;
  t.dy = frame.y[block / BLOCKS_ACROSS] - s.y;
  const Lanes log2_alpha = (s.xx * t.dx + s.xy * t.dy) * t.dx + (s.yy * t.dy * t.dy + s.log2_opacity);
  const Mask reached = at_least(log2_alpha, all(-LOG2_255));
  const Lanes clear = transmittance;
  const Lanes alpha = exp2(clamp(log2_alpha, -8, 0));  // above 0 only by cancellation, far out along a needle
  t.unclamped = below(alpha, all(ALPHA_MAX));
  t.alpha = min(alpha, all(ALPHA_MAX));
  const Lanes weight = t.alpha * clear, rest = clear - weight;
  t.on = reached & at_least(rest, all(CLEAR_MIN));  // never of a pixel that is used up: its rest is negative
  t.weight = where(t.on, weight);
  transmittance = select(t.on, rest, select(reached, negative(clear), clear));
}

// Walks over a tile's splats from front to back. at(place, splat, blocks) blends one over the blocks it touches;
// skip(place) is called for the splats behind a tile whose pixels are all used up.
template <class At, class Skip>
static inline void walk(const TileFrame& frame, const Splat* splats, const Tiles& tiles, int tile,
                        const Lanes* transmittance, At at, Skip skip) {
  const uint32_t end = tiles.first[tile + 1];
  uint32_t place = tiles.first[tile];
  Blocks alive = living(transmittance, lowest(BLOCKS));
  for (int count = 1; place < end && alive; place++, count++) {
    const uint32_t ahead = place + LOOK_AHEAD < end ? place + LOOK_AHEAD : end - 1;
    __builtin_prefetch(&splats[tiles.splat[ahead]]);
    const Splat& s = splats[tiles.splat[place]];
    at(place, s, touched(frame, s) & alive);
    if (count % ROLL_CALL == 0) alive = living(transmittance, alive);
  }
  for (; place < end; place++) skip(place);
}

}  // namespace ISA
}  // namespace raster
