// Gradients of splats from gradients of pixels, front to back like the forward pass.
//
// A splat's alpha weighs its own colour and dims all that lies behind it:
// dL/dalpha_i = T_i (f_i . g) - (sum over j > i of w_j (f_j . g) + T_end g_T) / (1 - alpha_i),
// f: colour and depth, g: their pixel's gradient, g_T = -g_alpha. The bracket starts as the finished pixel's
// C . g + T_end g_T and loses each splat's share as it is passed: nothing of the forward pass need be stored, and the
// cost hardly grows with the number of channels.
#include "blocks.h"
#include "kernels.h"

namespace raster {
namespace ISA {

template <int C, bool DEPTH>
static void backward_tile(const Splat* splats, const Tiles& tiles, const Images& images,
                          const ImageGradients& gradients, float* records, int tile) {
  constexpr int SIZE = MOMENTS + C + DEPTH;
  const TileFrame frame(tile, tiles, images);
  Lanes transmittance[BLOCKS], behind[BLOCKS], colour[C ? C : 1][BLOCKS], depth[DEPTH ? BLOCKS : 1];
  for (int b = 0; b < BLOCKS; b++) {
    behind[b] = all(0);
    for (int c = 0; c < C; c++) colour[c][b] = all(0);
    if (DEPTH) depth[b] = all(0);
  }
  frame.clear(transmittance);
  frame.each_pixel([&](int b, int lane, size_t pixel) {
    const size_t at = pixel * images.channels + images.channel;
    float sum = 0;
    for (int c = 0; c < C; c++) {
      const float g = gradients.colour[at + c];
      colour[c][b][lane] = g;
      sum += g * images.colour[at + c];
    }
    if (DEPTH) {
      depth[b][lane] = gradients.depth[pixel];
      sum += gradients.depth[pixel] * images.depth[pixel];
    }
    if (gradients.alpha) sum -= gradients.alpha[pixel] * (1.f - images.alpha[pixel]);
    behind[b][lane] = sum;
  });

  Lanes weight[BATCH * BLOCKS], by_alpha[BATCH * BLOCKS];  // by pair: blend weight, and v = dL / d ln alpha
  auto blend_back = [&](uint32_t place, const Batch& batch) {
    for (int pair = 0; pair < batch.pairs[batch.count]; pair++) {
      const int b = batch.block[pair];
      const Splat& s = splats[tiles.splat[place + batch.splat[pair]]];
      const Lanes alpha = batch.alpha[pair], clear = transmittance[b];
      weight[pair] = take(alpha, transmittance[b]);
      Lanes share = C ? colour[0][b] * s.colour[0] : all(0);
      for (int c = 1; c < C; c++) share += colour[c][b] * s.colour[c];
      if (DEPTH) share += depth[b] * s.depth;
      const Lanes rest = behind[b] - weight[pair] * share;
      behind[b] = rest;
      const Mask moves = below(all(0), weight[pair]) & below(alpha, all(ALPHA_MAX));
      by_alpha[pair] = where(moves, alpha * (clear * share - rest * reciprocal(1.f - alpha)));
    }
    for (int k = 0; k < batch.count; k++) {
      const TileSplat s = batch.splats[k];
      Lanes record[SIZE] = {};
      for (int pair = batch.pairs[k]; pair < batch.pairs[k + 1]; pair++) {
        const int b = batch.block[pair];
        const Lanes dx = offset_x(frame, s, b), dy = offset_y(frame, s, b);
        const Lanes v = by_alpha[pair], vx = v * dx, vy = v * dy;
        record[0] += v;
        record[1] += vx;
        record[2] += vy;
        record[3] += vx * dx;
        record[4] += vx * dy;
        record[5] += vy * dy;
        for (int c = 0; c < C; c++) record[MOMENTS + c] += weight[pair] * colour[c][b];
        if (DEPTH) record[MOMENTS + C] += weight[pair] * depth[b];
      }
      store_sums<SIZE>(records + (size_t)tiles.slot[place + k] * SIZE, record);
    }
  };
  const uint32_t end = tiles.first[tile + 1];
  for (uint32_t place = for_each_batch(frame, splats, tiles, tile, transmittance, blend_back); place < end; place++)
    memset(records + (size_t)tiles.slot[place] * SIZE, 0, 4 * SIZE);
}

template <int C>
static void blend_backward_tiles(const Splat* splats, const Tiles& tiles, const Images& images,
                                 const ImageGradients& gradients, float* records, int threads) {
#pragma omp parallel for num_threads(threads) schedule(dynamic, 2)
  for (int tile = 0; tile < tiles.columns * tiles.rows; tile++) {
    if (gradients.depth) backward_tile<C, true>(splats, tiles, images, gradients, records, tile);
    else backward_tile<C, false>(splats, tiles, images, gradients, records, tile);
  }
}

void blend_backward(const Splat* splats, const Tiles& tiles, const Images& images, const ImageGradients& gradients,
                    float* records, int threads) {
  switch (images.group) {
    case 0: return blend_backward_tiles<0>(splats, tiles, images, gradients, records, threads);
    case 1: return blend_backward_tiles<1>(splats, tiles, images, gradients, records, threads);
    case 2: return blend_backward_tiles<2>(splats, tiles, images, gradients, records, threads);
    case 3: return blend_backward_tiles<3>(splats, tiles, images, gradients, records, threads);
    default: return blend_backward_tiles<4>(splats, tiles, images, gradients, records, threads);
  }
}

void collect(const Tiles& tiles, size_t splats, const Values& values, int channel, int group, bool depth, bool add,
             const float* records, float* sums, float* gradients, int threads) {
  const int size = MOMENTS + group + depth;
#pragma omp parallel for num_threads(threads) schedule(static)
  for (ptrdiff_t i = 0; i < (ptrdiff_t)splats; i++) {
    float total[MOMENTS + GROUP + 1] = {};
    for (size_t slot = tiles.slots[i]; slot < tiles.slots[i + 1]; slot++)
      for (int k = 0; k < size; k++) total[k] += records[slot * size + k];
    float* to = sums + i * (MOMENTS + 1);
    for (int k = 0; k < MOMENTS; k++) to[k] = (add ? to[k] : 0) + total[k];
    to[MOMENTS] = (add ? to[MOMENTS] : 0) + (depth ? total[MOMENTS + group] : 0);
    for (int c = 0; c < group; c++) gradients[values.row(i) * values.channels + channel + c] = total[MOMENTS + c];
  }
}

}  // namespace ISA
}  // namespace raster
