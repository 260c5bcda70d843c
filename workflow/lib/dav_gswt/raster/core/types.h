// The data that the parts of the rasterizer share: plain structs and raw pointers, no code.
//
// The kernels are compiled once for every instruction set. A template of the standard library instantiated there would
// leave one copy for all of them, with instructions that an older processor lacks: so kernels own no memory and see
// none of std. context.cpp, compiled for the oldest processor, owns the memory and calls them.
#pragma once
#include <cstddef>
#include <cstdint>

namespace raster {

constexpr int TILE = 16;  // pixels a side
constexpr int GROUP = 4;  // channels that one pass over the tiles blends
constexpr int CHUNK = 256;  // Gaussians that are culled together
constexpr float ALPHA_MIN = 1.f / 255;  // a splat ends where its alpha falls below this
constexpr float ALPHA_MAX = 0.99f;  // keeps 1 / (1 - alpha) finite
constexpr float CLEAR_MIN = 1e-4f;  // a pixel takes no splat that would leave it less transmittance than this
constexpr float LOG2_255 = 7.994353437f;
constexpr float LOG2_E = 1.442695041f;
constexpr float LN2 = 0.6931471806f;

// A camera, and how Gaussians are drawn by it.
struct View {
  float rotation[9];  // world to camera: x right, y down, z forward
  float centre[3], centre_rest[3];  // the camera's place in the world is the sum of the two: far out float32 is coarse
  float fx, fy, cx, cy;
  float near;  // Gaussians whose centre is nearer are left out
  float dilation;  // variance added on the screen, in square pixels
  int width, height;
  bool orthographic;
  bool antialiased;  // opacity is multiplied by sqrt(det S0 / det S), S0 without, S with the dilation
};

// n Gaussians in the caller's arrays.
struct Scene {
  size_t n;
  const float *means, *log_scales, *quats, *opacity_logits;  // n x 3, 3, 4, 1
  const float* colours;  // n x channels, or n x coefficients x 3
  int channels;  // of a colour: 3 where there are coefficients
  int coefficients;  // of spherical harmonics: 1, 4, 9 or 16; 0: colours are plain channels
  const float* features;  // n x feature_channels; null if there are none
  int feature_channels;
};

struct SceneGradients {
  float *means, *log_scales, *quats, *opacity_logits, *colours, *features;
  float* camera;  // 6: by w and tau of the motion q' = exp([w]x) q + tau
};

// The Gaussians that may be visible, in their order; later stages refer to them by their index in this list.
struct Candidates {
  size_t count;
  const uint32_t* row;  // in the scene's arrays
};

// What is blended: row `rows[i]` of `from` is candidate i's, or row i where rows is null.
struct Values {
  const float* from;
  const uint32_t* rows;
  int channels;
  size_t row(size_t i) const { return rows ? rows[i] : i; }
};

// A Gaussian on the screen, one cache line. With (dx, dy) a pixel's offset from (x, y),
// log2 alpha = log2_opacity + xx dx^2 + xy dx dy + yy dy^2.
struct alignas(64) Splat {
  float x, y;  // pixels
  float xx, xy, yy;  // log2(e) times the conic: negative definite
  float log2_opacity;  // of the peak
  float half_x, half_y;  // half sides of the box around alpha >= ALPHA_MIN
  float correlation;  // of x and y, which tilts the ellipse
  float depth;
  float colour[GROUP];
  int16_t left, top, right, bottom;  // pixels of the picture in that box, the last ones included; none: right = -1

  bool visible() const { return right >= 0; }
};

// The splats of each tile. An intersection has a place (in its tile's list, front to back) and a slot (a splat's slots
// are contiguous, splats in their order). A tile writes its record of a splat into the slot; records are then summed in
// a fixed order, so that the number of threads changes no bit.
struct Tiles {
  int columns, rows;
  const uint32_t* first;  // tiles + 1: where a tile's list begins
  const uint32_t* splat;  // by place
  const uint32_t* slot;  // by place
  uint64_t* blocks;  // by place: the blocks of pixels of its tile that the splat meets, a bit for each
  const uint32_t* slots;  // splats + 1: where a splat's slots begin
};

// Images of one pass, row by row. Channels `channel ... channel + group - 1` of `channels` are those of this pass.
struct Images {
  int width, height, channels, channel, group;
  float *colour, *alpha, *depth;
};

struct ImageGradients {
  const float *colour, *alpha, *depth;  // alpha and depth may be null: zero
};

// All images of a scene.
struct Pictures {
  int width, height;
  float *colour, *alpha, *depth, *features;
};

struct PictureGradients {
  const float *colour, *alpha, *depth, *features;  // but for colour they may be null: zero
};

// A record of the backward pass, one a slot: moments of v = dL / d ln alpha around the splat's centre, then colour
// and, where asked for, depth: sum of v, v dx, v dy, v dx^2, v dx dy, v dy^2; w g for each channel; w g_depth.
constexpr int MOMENTS = 6;

// The contribution of each Gaussian of the scene to a picture, summed over its pixels.
struct ContributionSums {
  float *total, *maximum, *mapped;
};

struct LossTask {
  int width, height, channels;
  const float *image, *target, *weight;  // weight may be null: 1
  float structure;
  float* gradient;
  float* scratch;  // 4 planes of height rows of loss_stride floats
  double* row_sums;  // height
};

// Floats from row to row of a plane: whole vectors of the widest kind, and an odd number of them, or the rows above
// each other would fall into the same few sets of the cache.
static inline int loss_stride(const LossTask& t) { return ((t.width * t.channels + 15) / 16 | 1) * 16; }

constexpr int PATTERN = 16;  // rows of rates that lie behind each other: whole vectors of any kind

struct AdamTask {
  size_t rows;
  int columns;
  float* values;
  const float* gradient;
  float *first, *second;
  const bool* moved;  // by row; may be null: all
  float rate;
  const float* rates;  // by column, PATTERN times over; null: `rate` for all
  float beta1, beta2, epsilon;
  float correction1, correction2;  // 1 / (1 - beta^step)
};

// One instruction set's kernels. `threads` never changes a bit of any result.
struct Kernels {
  const char* name;
  // Candidates of each chunk of the scene: `rows` (from chunk * CHUNK on) and how many in `counts`. A Gaussian
  // that is left out has no pixel; one with a mean or a scale that is not finite is kept.
  void (*cull)(const Scene&, const View&, uint32_t* rows, uint32_t* counts, int threads);
  // Splats of the candidates and their colours by spherical harmonics (`sh_colours`, 3 each; else not written).
  // Returns false where an input is not finite or a quaternion is zero; what was written then means nothing.
  bool (*project)(const Scene&, const View&, const Candidates&, Splat*, float* sh_colours, int threads);
  // Returns false where a value is not finite.
  bool (*load_values)(const Values&, size_t splats, int channel, int group, Splat*, int threads);
  // Fills `blocks` of the tiles.
  void (*find_blocks)(const Splat*, const Tiles&, const Images&, int threads);
  void (*blend_forward)(const Splat*, const Tiles&, const Images&, bool only_colour, int threads);
  void (*blend_backward)(const Splat*, const Tiles&, const Images&, const ImageGradients&, float* records, int threads);
  // Sums records into `sums` (MOMENTS + 1 a splat, added to if `add`) and gradients by values (as Values has rows).
  void (*collect)(const Tiles&, size_t splats, const Values&, int channel, int group, bool depth, bool add,
                  const float* records, float* sums, float* gradients, int threads);
  // `by_sh_colours`: gradients by the colours that project gave; `motions`: room for 6 floats for every 4 candidates.
  void (*project_backward)(const Scene&, const View&, const Candidates&, const Splat*, const float* sums,
                           const float* sh_colours, const float* by_sh_colours, float* motions, const SceneGradients&,
                           int threads);
  // `records` has 3 + group floats a slot: maximum, sum and sum of squares of blend weights, weighted sums of `map`.
  void (*contribute)(const Splat*, const Tiles&, const Images& map, float* records, int threads);
  void (*collect_contributions)(const Tiles&, const Candidates&, int channels, int channel, int group,
                                const float* records, const ContributionSums&, int threads);
  // Pairs of a pixel and a splat blended into it, by tile.
  void (*count_pairs)(const Splat*, const Tiles&, const Images&, double* by_tile, int threads);
  void (*loss)(const LossTask&, int threads);
  void (*adam)(const AdamTask&, int threads);
  // Fused multiply-adds of floats that all threads do together in `rounds` rounds.
  double (*peak)(long rounds, int threads);
};

}  // namespace raster
