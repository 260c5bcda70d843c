#include "context.h"
#include "keep_apart.h"
#include <algorithm>
#include <new>
#include <stdexcept>

namespace raster {

#if defined(RASTER_X86_64)
namespace v2 { extern const Kernels table; }
namespace v3 { extern const Kernels table; }
namespace v4 { extern const Kernels table; }

std::vector<const Kernels*> available_kernels() {
  std::vector<const Kernels*> found;
  __builtin_cpu_init();
  const bool v3_ok = __builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma") && __builtin_cpu_supports("bmi") &&
                     __builtin_cpu_supports("bmi2") && __builtin_cpu_supports("f16c");
  const bool v4_ok = v3_ok && __builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512bw") &&
                     __builtin_cpu_supports("avx512cd") && __builtin_cpu_supports("avx512dq") &&
                     __builtin_cpu_supports("avx512vl");
  if (v4_ok) found.push_back(&v4::table);
  if (v3_ok) found.push_back(&v3::table);
  found.push_back(&v2::table);
  return found;
}
#else
namespace plain { extern const Kernels table; }

std::vector<const Kernels*> available_kernels() { return {&plain::table}; }
#endif

const Kernels& kernels_of(const std::string& name) {
  std::string names;
  for (const Kernels* k : available_kernels()) {
    if (name == k->name) return *k;
    names += std::string(names.empty() ? "" : ", ") + k->name;
  }
  throw std::invalid_argument("no instruction set '" + name + "' on this processor; it has " + names);
}

SplatStore::~SplatStore() { ::operator delete[](data_, std::align_val_t(alignof(Splat))); }

void SplatStore::resize(size_t n) {
  if (n <= capacity_) return;
  ::operator delete[](data_, std::align_val_t(alignof(Splat)));
  data_ = nullptr, capacity_ = 0;
  data_ = static_cast<Splat*>(::operator new[](n * sizeof(Splat), std::align_val_t(alignof(Splat))));
  capacity_ = n;
}

namespace {

// Calls f(channel, group) for each pass over the channels.
template <class F> void each_pass(int channels, F f) {
  for (int channel = 0; channel < channels; channel += GROUP) f(channel, std::min(GROUP, channels - channel));
}

Images pass_of(const Images& images, int channel, int group) {
  Images pass = images;
  pass.channel = channel;
  pass.group = group;
  return pass;
}

}  // namespace

bool Context::forward(const Scene& scene, const View& view, const Images& images, int threads) {
  processor_ = keep_apart(threads, processor_);
  view_ = view;
  splats_.resize(scene.n);
  if (!kernels_.project(scene, view, splats_.data(), threads)) return false;
  binning_.sort(splats_.data(), scene.n, view.width, view.height, threads);
  bool valid = true;
  each_pass(scene.channels, [&](int channel, int group) {
    valid = valid && kernels_.load_colours(scene, channel, group, splats_.data(), threads);
    if (!valid) return;
    kernels_.blend_forward(splats_.data(), binning_.tiles(), pass_of(images, channel, group), channel > 0, threads);
  });
  return valid;
}

void Context::backward(const Scene& scene, const Images& images, const ImageGradients& gradients,
                       const SceneGradients& out, int threads) {
  processor_ = keep_apart(threads, processor_);
  sums_.resize(scene.n * (MOMENTS + 1));
  each_pass(scene.channels, [&](int channel, int group) {
    const bool first = channel == 0, depth = first && gradients.depth;
    ImageGradients pass = gradients;
    if (!first) pass.alpha = pass.depth = nullptr;  // they count once
    records_.resize(binning_.intersections() * (MOMENTS + group + depth));
    if (scene.channels > GROUP) kernels_.load_colours(scene, channel, group, splats_.data(), threads);
    kernels_.blend_backward(splats_.data(), binning_.tiles(), pass_of(images, channel, group), pass, records_.data(),
                            threads);
    kernels_.collect(binning_.tiles(), scene.n, scene.channels, channel, group, depth, !first, records_.data(),
                     sums_.data(), out.colours, threads);
  });
  kernels_.project_backward(scene, view_, splats_.data(), sums_.data(), out, threads);
}

void Context::contributions(const Scene& scene, const Images& map, float* total, float* maximum, float* mapped,
                            int threads) {
  auto pass = [&](int channel, int group) {
    records_.resize(binning_.intersections() * (2 + group));
    kernels_.contribute(splats_.data(), binning_.tiles(), pass_of(map, channel, group), records_.data(), threads);
    kernels_.collect_contributions(binning_.tiles(), scene.n, map.channels, channel, group, records_.data(), total,
                                   maximum, mapped, threads);
  };
  if (map.channels == 0) pass(0, 0);
  each_pass(map.channels, pass);
}

}  // namespace raster
