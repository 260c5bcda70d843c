// What the parts of the rasterizer hand to each other: plain data and raw pointers, no code.
//
// The kernels are compiled once for every instruction set. A template of the standard library instantiated there would
// leave one copy for all of them, with instructions that an older processor lacks: so kernels own no memory and see
// none of std. context.cpp, compiled for the oldest processor, owns the memory and calls them.
#pragma once
#include <cstddef>
#include <cstdint>

namespace raster {

constexpr int TILE = 16;             // pixels a side
constexpr int GROUP = 4;             // colour channels that one pass over the tiles blends
constexpr float ALPHA_MIN = 1.f / 255;  // a splat ends where its alpha falls below this
constexpr float ALPHA_MAX = 0.99f;   // keeps 1 / (1 - alpha) finite
constexpr float CLEAR_MIN = 1e-4f;   // a pixel takes no splat that would leave it less transmittance than this
constexpr float LOG2_255 = 7.994353437f;
constexpr float LOG2_E = 1.442695041f;
constexpr float LN2 = 0.6931471806f;

// A camera, and how Gaussians are drawn by it.
struct View {
  float rotation[9], translation[3];  // world to camera: x right, y down, z forward
  float fx, fy, cx, cy;
  float near;      // Gaussians whose centre is nearer are left out
  float dilation;  // variance added on the screen, in square pixels
  int width, height;
  bool orthographic;
};

// n Gaussians as the caller holds them.
struct Scene {
  size_t n;
  const float *means, *log_scales, *quats, *opacity_logits;  // n x 3, 3, 4, 1
  const float* colours;                                      // n x channels
  int channels;
};

struct SceneGradients {
  float *means, *log_scales, *quats, *opacity_logits, *colours;
};

// A Gaussian on the screen, one cache line. With (dx, dy) a pixel's offset from (x, y),
// log2 alpha = log2_opacity + xx dx^2 + xy dx dy + yy dy^2.
struct alignas(64) Splat {
  float x, y;            // pixels
  float xx, xy, yy;      // log2(e) times the conic: negative definite
  float log2_opacity;
  float half_x, half_y;  // half sides of the box around alpha >= ALPHA_MIN
  float depth;
  float colour[GROUP];
  int16_t left, top, right, bottom;  // pixels of the picture in that box, the last ones included; none: right = -1

  bool drawn() const { return right >= 0; }
};

// Who lies in which tile. An intersection has a place (in its tile's list, front to back) and a slot (a Gaussian's
// slots follow each other, Gaussians in their order): what a tile finds out about a Gaussian goes into the slot, and
// is summed from there in a fixed order.
struct Tiles {
  int columns, rows;
  const uint32_t* first;      // tiles + 1: where a tile's list begins
  const uint32_t* gaussian;   // by place
  const uint32_t* slot;       // by place
  const uint32_t* slots;      // n + 1: where a Gaussian's slots begin
};

// Images, row by row. Channels `channel ... channel + group - 1` of `channels` are those of this pass.
struct Images {
  int width, height, channels, channel, group;
  float *colour, *alpha, *depth;
};

struct ImageGradients {
  const float *colour, *alpha, *depth;  // alpha and depth may be null: zero
};

// A record of the backward pass, one a slot: moments of v = dL / d ln alpha around the splat's centre, then colour
// and, where asked for, depth: sum of v, v dx, v dy, v dx^2, v dx dy, v dy^2; w g for each channel; w g_depth.
constexpr int MOMENTS = 6;

struct LossTask {
  int width, height, channels;
  const float *image, *target, *weight;  // weight may be null: 1
  float structure;
  float* gradient;
  float* scratch;     // 4 planes of height rows of loss_stride floats
  double* row_sums;   // height
};

// Floats from row to row of a plane: whole vectors of the widest kind, and an odd number of them, or the rows above
// each other would fall into the same few sets of the cache.
static inline int loss_stride(const LossTask& t) { return ((t.width * t.channels + 15) / 16 | 1) * 16; }

struct AdamTask {
  size_t rows;
  int columns;
  float* values;
  const float* gradient;
  float *first, *second;
  const bool* moved;  // by row; may be null: all
  float rate, beta1, beta2, epsilon;
  float correction1, correction2;  // 1 / (1 - beta^step)
};

// One instruction set's kernels. `threads` never changes a bit of any result.
struct Kernels {
  const char* name;
  // Returns false where an input is not finite or a quaternion is zero; what was written then means nothing.
  bool (*project)(const Scene&, const View&, Splat*, int threads);
  bool (*load_colours)(const Scene&, int channel, int group, Splat*, int threads);
  void (*blend_forward)(const Splat*, const Tiles&, const Images&, bool only_colour, int threads);
  void (*blend_backward)(const Splat*, const Tiles&, const Images&, const ImageGradients&, float* records, int threads);
  // Sums records into `sums` (n x (MOMENTS + 1), added to if `add`) and colour gradients.
  void (*collect)(const Tiles&, size_t n, int channels, int channel, int group, bool depth, bool add,
                  const float* records, float* sums, float* colours, int threads);
  void (*project_backward)(const Scene&, const View&, const Splat*, const float* sums, const SceneGradients&,
                           int threads);
  // `records` has 2 + group floats a slot: sum and maximum of blend weights, weighted sums of `map`.
  void (*contribute)(const Splat*, const Tiles&, const Images& map, float* records, int threads);
  void (*collect_contributions)(const Tiles&, size_t n, int channels, int channel, int group, const float* records,
                                float* total, float* maximum, float* mapped, int threads);
  void (*loss)(const LossTask&, int threads);
  void (*adam)(const AdamTask&, int threads);
};

}  // namespace raster
