// The blocks of its tile's pixels that each splat meets: found once, used by every pass over the tiles.
#include "blocks.h"
#include "kernels.h"

namespace raster {
namespace ISA {

constexpr int AHEAD = 16;  // splats between the one at work and the prefetched one

void find_blocks(const Splat* splats, const Tiles& tiles, const Images& images, int threads) {
#pragma omp parallel for num_threads(threads) schedule(dynamic, 8)
  for (int tile = 0; tile < tiles.columns * tiles.rows; tile++) {
    const TileFrame frame(tile, tiles, images);
    const uint32_t end = tiles.first[tile + 1];
    for (uint32_t place = tiles.first[tile]; place < end; place++) {
      __builtin_prefetch(&splats[tiles.splat[place + AHEAD < end ? place + AHEAD : end - 1]]);
      tiles.blocks[place] = blocks_met(frame, splats[tiles.splat[place]]);
    }
  }
}

}  // namespace ISA
}  // namespace raster
