// The kernels of one instruction set, by name; kernels.cpp puts them into its table.
#pragma once
#include "types.h"

namespace raster {
namespace ISA {

void cull(const Scene&, const View&, uint32_t* rows, uint32_t* counts, int threads);
bool project(const Scene&, const View&, const Candidates&, Splat*, float* sh_colours, int threads);
bool load_values(const Values&, size_t splats, int channel, int group, Splat*, int threads);
void find_blocks(const Splat*, const Tiles&, const Images&, int threads);
void blend_forward(const Splat*, const Tiles&, const Images&, bool only_colour, int threads);
void blend_backward(const Splat*, const Tiles&, const Images&, const ImageGradients&, float* records, int threads);
void collect(const Tiles&, size_t splats, const Values&, int channel, int group, bool depth, bool add,
             const float* records, float* sums, float* gradients, int threads);
void project_backward(const Scene&, const View&, const Candidates&, const Splat*, const float* sums,
                      const float* sh_colours, const float* by_sh_colours, float* motions, const SceneGradients&,
                      int threads);
void contribute(const Splat*, const Tiles&, const Images& map, float* records, int threads);
void collect_contributions(const Tiles&, const Candidates&, int channels, int channel, int group, const float* records,
                           const ContributionSums&, int threads);
void count_pairs(const Splat*, const Tiles&, const Images&, double* by_tile, int threads);
void loss(const LossTask&, int threads);
void adam(const AdamTask&, int threads);
double peak(long rounds, int threads);

}  // namespace ISA
}  // namespace raster
