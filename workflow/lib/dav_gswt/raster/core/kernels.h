// The kernels of one instruction set, by name; kernels.cpp puts them into its table.
#pragma once
#include "types.h"

namespace raster {
namespace ISA {

bool project(const Scene&, const View&, Splat*, int threads);
bool load_colours(const Scene&, int channel, int group, Splat*, int threads);
void blend_forward(const Splat*, const Tiles&, const Images&, bool only_colour, int threads);
void blend_backward(const Splat*, const Tiles&, const Images&, const ImageGradients&, float* records, int threads);
void collect(const Tiles&, size_t n, int channels, int channel, int group, bool depth, bool add, const float* records,
             float* sums, float* colours, int threads);
void project_backward(const Scene&, const View&, const Splat*, const float* sums, const SceneGradients&, int threads);
void contribute(const Splat*, const Tiles&, const Images& map, float* records, int threads);
void collect_contributions(const Tiles&, size_t n, int channels, int channel, int group, const float* records,
                           float* total, float* maximum, float* mapped, int threads);
void loss(const LossTask&, int threads);
void adam(const AdamTask&, int threads);

}  // namespace ISA
}  // namespace raster
