#include "context.h"
#include "thread_affinity.h"
#include <algorithm>
#include <cstring>
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

const std::array<const char*, STAGES> STAGE_NAMES = {"cull",  "project",        "sort",    "find blocks",     "blend",
                                                     "clear", "blend backward", "collect", "project backward"};

void StageClock::start(Stage first, Stage end) {
  std::fill(&seconds_[first], seconds_.data() + end, 0.0);
  last_ = std::chrono::steady_clock::now();
}

void StageClock::stop(Stage stage) {
  const auto now = std::chrono::steady_clock::now();
  seconds_[stage] += std::chrono::duration<double>(now - last_).count();
  last_ = now;
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

// Calls f(channel, group) for each pass over the channels; once if there are none.
template <class F> void each_pass(int channels, F f) {
  int channel = 0;
  do f(channel, std::min(GROUP, channels - channel));
  while ((channel += GROUP) < channels);
}

Images pass_of(const Images& images, int channel, int group) {
  Images pass = images;
  pass.channel = channel;
  pass.group = group;
  return pass;
}

// Zeroes the rows of chunks that are not all candidates; the candidates' rows are written later.
void clear(float* array, size_t columns, size_t n, const std::vector<uint32_t>& counts, int threads) {
#pragma omp parallel for num_threads(threads) schedule(static)
  for (ptrdiff_t chunk = 0; chunk < ptrdiff_t(counts.size()); chunk++) {
    const size_t begin = size_t(chunk) * CHUNK, rows = std::min<size_t>(CHUNK, n - begin);
    if (counts[chunk] < rows) std::memset(array + begin * columns, 0, rows * columns * sizeof(float));
  }
}

bool features_seen(const Scene& scene) { return scene.features && scene.feature_channels > 0; }

}  // namespace

Values Context::colours(const Scene& scene) const {
  if (scene.coefficients) return {sh_colours_.data(), nullptr, 3};
  return {scene.colours, rows_.data(), scene.channels};
}

Values Context::features(const Scene& scene) const { return {scene.features, rows_.data(), scene.feature_channels}; }

// Joins the candidates of all chunks.
void Context::cull(const Scene& scene, int threads) {
  const size_t chunks = (scene.n + CHUNK - 1) / CHUNK;
  found_.resize(scene.n);
  counts_.resize(chunks);
  kernels_.cull(scene, view_, found_.data(), counts_.data(), threads);
  size_t total = 0;
  for (uint32_t count : counts_) total += count;
  rows_.resize(total);
  uint32_t* to = rows_.data();
  for (size_t chunk = 0; chunk < chunks; chunk++) {
    std::copy_n(&found_[chunk * CHUNK], counts_[chunk], to);
    to += counts_[chunk];
  }
}

bool Context::draw(const Values& values, Images images, bool only_colour, int threads) {
  bool valid = true;
  images.channels = values.channels;
  each_pass(values.channels, [&](int channel, int group) {
    valid = valid && kernels_.load_values(values, rows_.size(), channel, group, splats_.data(), threads);
    if (!valid) return;
    kernels_.blend_forward(splats_.data(), binning_.tiles(), pass_of(images, channel, group),
                           only_colour || channel > 0, threads);
  });
  clock_.stop(BLEND);
  return valid;
}

bool Context::forward(const Scene& scene, const View& view, const Pictures& pictures, int threads) {
  const ThreadAffinity affinity(threads);
  view_ = view;
  clock_.start(CULL, CLEAR);
  cull(scene, threads);
  clock_.stop(CULL);
  splats_.resize(rows_.size());
  if (scene.coefficients) sh_colours_.resize(3 * rows_.size());
  if (!kernels_.project(scene, view, candidates(), splats_.data(), sh_colours_.data(), threads)) return false;
  clock_.stop(PROJECT);
  binning_.sort(splats_.data(), rows_.size(), view.width, view.height, threads);
  clock_.stop(SORT);
  const Images images{view.width, view.height, 0, 0, 0, pictures.colour, pictures.alpha, pictures.depth};
  kernels_.find_blocks(splats_.data(), binning_.tiles(), images, threads);
  clock_.stop(FIND_BLOCKS);
  if (!draw(colours(scene), images, false, threads)) return false;
  if (!features_seen(scene)) return true;
  Images second = images;
  second.colour = pictures.features;
  return draw(features(scene), second, true, threads);
}

void Context::backward_pass(const Values& values, Images images, ImageGradients given, bool first, bool reload,
                            float* gradients, int threads) {
  images.channels = values.channels;
  each_pass(values.channels, [&](int channel, int group) {
    if (!first || channel > 0) given.alpha = given.depth = nullptr;  // counted once
    const bool depth = given.depth != nullptr;
    records_.resize(binning_.intersections() * (MOMENTS + group + depth));
    if (reload) kernels_.load_values(values, rows_.size(), channel, group, splats_.data(), threads);
    kernels_.blend_backward(splats_.data(), binning_.tiles(), pass_of(images, channel, group), given, records_.data(),
                            threads);
    clock_.stop(BLEND_BACKWARD);
    kernels_.collect(binning_.tiles(), rows_.size(), values, channel, group, depth, !first || channel > 0,
                     records_.data(), sums_.data(), gradients, threads);
    clock_.stop(COLLECT);
  });
}

void Context::backward(const Scene& scene, const Pictures& pictures, const PictureGradients& given,
                       const SceneGradients& out, int threads) {
  const ThreadAffinity affinity(threads);
  const size_t width = scene.coefficients ? 3 * scene.coefficients : scene.channels;
  clock_.start(CLEAR, STAGES);
  clear(out.means, 3, scene.n, counts_, threads);
  clear(out.log_scales, 3, scene.n, counts_, threads);
  clear(out.quats, 4, scene.n, counts_, threads);
  clear(out.opacity_logits, 1, scene.n, counts_, threads);
  clear(out.colours, width, scene.n, counts_, threads);
  sums_.resize(rows_.size() * (MOMENTS + 1));
  motions_.resize((rows_.size() + 3) / 4 * 6);
  if (scene.coefficients) by_sh_colours_.resize(3 * rows_.size());
  clock_.stop(CLEAR);

  const bool reload = scene.channels > GROUP || features_seen(scene);  // the splats hold what was drawn last
  const Images images{view_.width, view_.height, 0, 0, 0, pictures.colour, pictures.alpha, pictures.depth};
  backward_pass(colours(scene), images, {given.colour, given.alpha, given.depth}, true, reload,
                scene.coefficients ? by_sh_colours_.data() : out.colours, threads);
  if (features_seen(scene) && given.features) {
    clear(out.features, scene.feature_channels, scene.n, counts_, threads);
    Images second = images;
    second.colour = pictures.features;
    backward_pass(features(scene), second, {given.features, nullptr, nullptr}, false, true, out.features, threads);
  } else if (features_seen(scene)) {
    std::memset(out.features, 0, scene.n * scene.feature_channels * sizeof(float));
  }
  kernels_.project_backward(scene, view_, candidates(), splats_.data(), sums_.data(), sh_colours_.data(),
                            by_sh_colours_.data(), motions_.data(), out, threads);
  clock_.stop(PROJECT_BACKWARD);
}

void Context::contributions(const Scene& scene, const Images& map, const ContributionSums& out, int threads) {
  for (float* each : {out.total, out.maximum}) clear(each, 1, scene.n, counts_, threads);
  clear(out.mapped, map.channels, scene.n, counts_, threads);
  each_pass(map.channels, [&](int channel, int group) {
    records_.resize(binning_.intersections() * (2 + group));
    kernels_.contribute(splats_.data(), binning_.tiles(), pass_of(map, channel, group), records_.data(), threads);
    kernels_.collect_contributions(binning_.tiles(), candidates(), map.channels, channel, group, records_.data(), out,
                                   threads);
  });
}

void Context::visible(size_t n, bool* out) const {
  std::memset(out, 0, n);
  const uint32_t* slots = binning_.slots();
  for (size_t i = 0; i < rows_.size(); i++) out[rows_[i]] = slots[i + 1] > slots[i];
}

double Context::pairs(int threads) {
  const Tiles tiles = binning_.tiles();
  by_tile_.resize(size_t(tiles.columns) * tiles.rows);
  const Images images{view_.width, view_.height, 0, 0, 0, nullptr, nullptr, nullptr};
  kernels_.count_pairs(splats_.data(), tiles, images, by_tile_.data(), threads);
  double total = 0;
  for (double each : by_tile_) total += each;
  return total;
}

}  // namespace raster
