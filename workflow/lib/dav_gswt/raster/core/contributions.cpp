// The contribution of each Gaussian to the picture: sum and maximum of its blend weights, and sums of a map weighted by
// them.
#include "blocks.h"
#include "kernels.h"

namespace raster {
namespace ISA {

static inline float largest(Lanes v) {
  float found = v[0];
  for (int l = 1; l < LANES; l++) found = v[l] > found ? v[l] : found;
  return found;
}

template <int C>
static void contribute_tile(const Splat* splats, const Tiles& tiles, const Images& map, float* records, int tile) {
  constexpr int SIZE = 2 + C;
  const TileFrame frame(tile, tiles, map);
  Lanes transmittance[BLOCKS], values[C ? C : 1][BLOCKS] = {};
  frame.clear(transmittance);
  frame.each_pixel([&](int b, int lane, size_t pixel) {
    for (int c = 0; c < C; c++) values[c][b][lane] = map.colour[pixel * map.channels + map.channel + c];
  });

  auto add = [&](uint32_t place, const Batch& batch) {
    for (int k = 0; k < batch.count; k++) {
      Lanes sums[1 + C] = {}, maximum = {};
      for (int pair = batch.pairs[k]; pair < batch.pairs[k + 1]; pair++) {
        const int b = batch.block[pair];
        const Lanes weight = take(batch.alpha[pair], transmittance[b]);
        sums[0] += weight;
        maximum = max(maximum, weight);
        for (int c = 0; c < C; c++) sums[1 + c] += weight * values[c][b];
      }
      float* record = records + (size_t)tiles.slot[place + k] * SIZE;
      record[0] = largest(maximum);
      store_sums<1 + C>(record + 1, sums);
    }
  };
  const uint32_t end = tiles.first[tile + 1];
  for (uint32_t place = for_each_batch(frame, splats, tiles, tile, transmittance, add); place < end; place++)
    memset(records + (size_t)tiles.slot[place] * SIZE, 0, 4 * SIZE);
}

template <int C>
static void contribute_tiles(const Splat* splats, const Tiles& tiles, const Images& map, float* records, int threads) {
#pragma omp parallel for num_threads(threads) schedule(dynamic, 2)
  for (int tile = 0; tile < tiles.columns * tiles.rows; tile++) contribute_tile<C>(splats, tiles, map, records, tile);
}

void contribute(const Splat* splats, const Tiles& tiles, const Images& map, float* records, int threads) {
  switch (map.group) {
    case 0: return contribute_tiles<0>(splats, tiles, map, records, threads);
    case 1: return contribute_tiles<1>(splats, tiles, map, records, threads);
    case 2: return contribute_tiles<2>(splats, tiles, map, records, threads);
    case 3: return contribute_tiles<3>(splats, tiles, map, records, threads);
    default: return contribute_tiles<4>(splats, tiles, map, records, threads);
  }
}

void collect_contributions(const Tiles& tiles, const Candidates& candidates, int channels, int channel, int group,
                           const float* records, const ContributionSums& out, int threads) {
  const int size = 2 + group;
#pragma omp parallel for num_threads(threads) schedule(static)
  for (ptrdiff_t i = 0; i < (ptrdiff_t)candidates.count; i++) {
    float most = 0, sums[1 + GROUP] = {};
    for (size_t slot = tiles.slots[i]; slot < tiles.slots[i + 1]; slot++) {
      const float* record = records + slot * size;
      most = record[0] > most ? record[0] : most;
      for (int k = 0; k < 1 + group; k++) sums[k] += record[1 + k];
    }
    const size_t row = candidates.row[i];
    out.maximum[row] = most;
    out.total[row] = sums[0];
    for (int c = 0; c < group; c++) out.mapped[row * channels + channel + c] = sums[1 + c];
  }
}

void count_pairs(const Splat* splats, const Tiles& tiles, const Images& images, double* by_tile, int threads) {
#pragma omp parallel for num_threads(threads) schedule(dynamic, 2)
  for (int tile = 0; tile < tiles.columns * tiles.rows; tile++) {
    const TileFrame frame(tile, tiles, images);
    Lanes transmittance[BLOCKS];
    frame.clear(transmittance);
    double pairs = 0;
    auto count = [&](uint32_t, const Batch& batch) {
      Lanes taken = all(0);
      for (int pair = 0; pair < batch.pairs[batch.count]; pair++)
        taken += where(below(all(0), take(batch.alpha[pair], transmittance[batch.block[pair]])), all(1));
      for (int l = 0; l < LANES; l++) pairs += taken[l];
    };
    for_each_batch(frame, splats, tiles, tile, transmittance, count);
    by_tile[tile] = pairs;
  }
}

}  // namespace ISA
}  // namespace raster
