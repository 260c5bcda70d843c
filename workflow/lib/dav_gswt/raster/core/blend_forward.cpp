// Colour, alpha and depth of every pixel: splats from front to back, each weighted by alpha times transmittance.
#include "blocks.h"
#include "kernels.h"

namespace raster {
namespace ISA {

template <int C>
static void blend_tile(const Splat* splats, const Tiles& tiles, const Images& images, bool only_colour, int tile) {
  const TileFrame frame(tile, tiles, images);
  Lanes transmittance[BLOCKS], colour[C ? C : 1][BLOCKS], depth[BLOCKS];
  for (int b = 0; b < BLOCKS; b++) {
    for (int c = 0; c < C; c++) colour[c][b] = all(0);
    depth[b] = all(0);
  }
  frame.clear(transmittance);

  auto blend = [&](uint32_t, const Splat& s, Blocks blocks) {
    const TileSplat tile_splat(frame, s);
    for (; blocks; blocks &= blocks - 1) {
      const int b = __builtin_ctzll(blocks);
      const Lanes weight = take(alpha_of(frame, tile_splat, b), transmittance[b]);
      for (int c = 0; c < C; c++) colour[c][b] += weight * s.colour[c];
      depth[b] += weight * s.depth;
    }
  };
  for_each_splat(splats, tiles, tile, transmittance, blend);

  frame.each_pixel([&](int b, int lane, size_t pixel) {
    float* to = images.colour + pixel * images.channels + images.channel;
    for (int c = 0; c < C; c++) to[c] = colour[c][b][lane];
    if (only_colour) return;
    images.alpha[pixel] = 1.f - __builtin_fabsf(transmittance[b][lane]);
    images.depth[pixel] = depth[b][lane];
  });
}

template <int C>
static void blend(const Splat* splats, const Tiles& tiles, const Images& images, bool only_colour, int threads) {
#pragma omp parallel for num_threads(threads) schedule(dynamic, 2)
  for (int tile = 0; tile < tiles.columns * tiles.rows; tile++) blend_tile<C>(splats, tiles, images, only_colour, tile);
}

void blend_forward(const Splat* splats, const Tiles& tiles, const Images& images, bool only_colour, int threads) {
  switch (images.group) {
    case 0: return blend<0>(splats, tiles, images, only_colour, threads);
    case 1: return blend<1>(splats, tiles, images, only_colour, threads);
    case 2: return blend<2>(splats, tiles, images, only_colour, threads);
    case 3: return blend<3>(splats, tiles, images, only_colour, threads);
    default: return blend<4>(splats, tiles, images, only_colour, threads);
  }
}

}  // namespace ISA
}  // namespace raster
