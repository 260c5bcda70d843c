// One rasterizer: the memory that calls share, and the order in which the kernels run.
#pragma once
#include "bin.h"
#include "types.h"
#include <string>
#include <vector>

namespace raster {

// Instruction sets that this processor has, best first; never empty.
std::vector<const Kernels*> available_kernels();

// The kernels of that name. Throws std::invalid_argument if this processor lacks them.
const Kernels& kernels_of(const std::string& name);

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
  bool forward(const Scene&, const View&, const Images&, int threads);
  // Gradients at the last forward's scene and images, which must be the same and unchanged.
  void backward(const Scene&, const Images&, const ImageGradients&, const SceneGradients&, int threads);
  // Blend weights of the last forward; `map` has 0 or more channels in `colour`.
  void contributions(const Scene&, const Images& map, float* total, float* maximum, float* mapped, int threads);
  size_t intersections() const { return binning_.intersections(); }

 private:
  const Kernels& kernels_;
  int processor_ = -1;  // that the other threads keep off
  View view_{};
  SplatStore splats_;
  Binning binning_;
  std::vector<float> records_, sums_;
};

}  // namespace raster
