// A rasterizer: its memory, reused from call to call, and the order in which the kernels run.
#pragma once
#include "bin.h"
#include "types.h"
#include <array>
#include <chrono>
#include <string>
#include <vector>

namespace raster {

// Instruction sets that this processor has, best first; never empty.
std::vector<const Kernels*> available_kernels();

// The kernels of that name. Throws std::invalid_argument if this processor lacks them.
const Kernels& kernels_of(const std::string& name);

// What a call does, in this order; `clear` is the first of the backward pass.
enum Stage { CULL, PROJECT, SORT, FIND_BLOCKS, BLEND, CLEAR, BLEND_BACKWARD, COLLECT, PROJECT_BACKWARD, STAGES };
extern const std::array<const char*, STAGES> STAGE_NAMES;

// Seconds of each stage.
class StageClock {
 public:
  // Begins a pass: its stages, those from `first` on to before `end`, start at zero.
  void start(Stage first, Stage end);
  // The time since the last stop was spent on a stage.
  void stop(Stage stage);
  const std::array<double, STAGES>& seconds() const { return seconds_; }

 private:
  std::array<double, STAGES> seconds_{};
  std::chrono::steady_clock::time_point last_;
};

// Memory for the splats: a vector aligns only as far as operator new does.
class SplatStore {
 public:
  ~SplatStore();
  SplatStore() = default;
  SplatStore(const SplatStore&) = delete;
  SplatStore& operator=(const SplatStore&) = delete;
  void resize(size_t n);
  Splat* data() const { return data_; }

 private:
  Splat* data_ = nullptr;
  size_t capacity_ = 0;
};

class Context {
 public:
  explicit Context(const Kernels& kernels) : kernels_(kernels) {}
  // Draws a scene. Returns false if an input is not finite or a quaternion is zero: then nothing was drawn.
  bool forward(const Scene&, const View&, const Pictures&, int threads);
  // Gradients at the last forward's scene and pictures, which must be the same and unchanged. Every row is written.
  void backward(const Scene&, const Pictures&, const PictureGradients&, const SceneGradients&, int threads);
  // Blend weights of the last forward; `map` has 0 or more channels in `colour`.
  void contributions(const Scene&, const Images& map, const ContributionSums&, int threads);
  // Marks the Gaussians of the last forward that lie in a tile.
  void visible(size_t n, bool* out) const;
  // Pairs of a pixel and a splat blended into it, of the last forward.
  double pairs(int threads);
  size_t intersections() const { return binning_.intersections(); }
  // Of the last forward and the last backward.
  const std::array<double, STAGES>& seconds() const { return clock_.seconds(); }

 private:
  Candidates candidates() const { return {rows_.size(), rows_.data()}; }
  void cull(const Scene&, int threads);
  // What is blended: colours, then features.
  Values colours(const Scene&) const;
  Values features(const Scene&) const;
  bool draw(const Values&, Images, bool only_colour, int threads);
  void backward_pass(const Values&, Images, ImageGradients, bool first, bool reload, float* gradients, int threads);

  const Kernels& kernels_;
  View view_{};
  std::vector<uint32_t> found_, counts_, rows_;  // by chunk; the candidates
  SplatStore splats_;
  Binning binning_;
  std::vector<float> records_, sums_, sh_colours_, by_sh_colours_, motions_;
  std::vector<double> by_tile_;
  StageClock clock_;
};

}  // namespace raster
