// The Python module. Shapes and types are checked in cpu.py; here arrays become pointers, without copies.
#include "context.h"
#include "sample.h"
#include "thread_affinity.h"
#include <algorithm>
#include <chrono>
#include <cmath>
#include <memory>
#include <nanobind/nanobind.h>
#include <nanobind/ndarray.h>
#include <nanobind/stl/optional.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/vector.h>
#include <optional>

namespace nb = nanobind;
using namespace raster;

using In = nb::ndarray<const float, nb::c_contig, nb::device::cpu>;
using Out = nb::ndarray<float, nb::c_contig, nb::device::cpu>;
using Rows = nb::ndarray<const bool, nb::c_contig, nb::device::cpu>;
using Flags = nb::ndarray<bool, nb::c_contig, nb::device::cpu>;
using MaybeIn = std::optional<In>;
using MaybeOut = std::optional<Out>;

namespace {

const float* pointer(const MaybeIn& a) { return a ? a->data() : nullptr; }
float* pointer(const MaybeOut& a) { return a ? a->data() : nullptr; }

// numbers: rotation (9), centre (3), rest of the centre (3), fx, fy, cx, cy, near, dilation
View view_of(const In& numbers, int width, int height, bool orthographic, bool antialiased) {
  View v;
  const float* from = numbers.data();
  std::copy(from, from + 9, v.rotation);
  std::copy(from + 9, from + 12, v.centre);
  std::copy(from + 12, from + 15, v.centre_rest);
  v.fx = from[15], v.fy = from[16], v.cx = from[17], v.cy = from[18], v.near = from[19], v.dilation = from[20];
  v.width = width, v.height = height, v.orthographic = orthographic, v.antialiased = antialiased;
  return v;
}

Scene scene_of(const In& means, const In& log_scales, const In& quats, const In& logits, const In& colours,
               const MaybeIn& features) {
  const bool harmonics = colours.ndim() == 3;
  return {means.shape(0),
          means.data(),
          log_scales.data(),
          quats.data(),
          logits.data(),
          colours.data(),
          harmonics ? 3 : int(colours.shape(1)),
          harmonics ? int(colours.shape(1)) : 0,
          pointer(features),
          features ? int(features->shape(1)) : 0};
}

// The kernels only read what they are not asked to write.
float* unread(const In& a) { return const_cast<float*>(a.data()); }

bool forward(Context& context, In means, In log_scales, In quats, In logits, In colours, MaybeIn features, In camera,
             int width, int height, bool orthographic, bool antialiased, Out colour, Out alpha, Out depth,
             MaybeOut features_seen, int threads) {
  const Pictures pictures{width, height, colour.data(), alpha.data(), depth.data(), pointer(features_seen)};
  const Scene scene = scene_of(means, log_scales, quats, logits, colours, features);
  const View view = view_of(camera, width, height, orthographic, antialiased);
  nb::gil_scoped_release release;
  return context.forward(scene, view, pictures, threads);
}

void backward(Context& context, In means, In log_scales, In quats, In logits, In colours, MaybeIn features, In colour,
              In alpha, In depth, MaybeIn features_seen, In grad_colour, MaybeIn grad_alpha, MaybeIn grad_depth,
              MaybeIn grad_features, Out d_means, Out d_log_scales, Out d_quats, Out d_logits, Out d_colours,
              MaybeOut d_features, Out d_camera, int threads) {
  const Scene scene = scene_of(means, log_scales, quats, logits, colours, features);
  const Pictures pictures{int(colour.shape(1)), int(colour.shape(0)), unread(colour),
                          unread(alpha),        unread(depth),        features_seen ? unread(*features_seen) : nullptr};
  const PictureGradients given{grad_colour.data(), pointer(grad_alpha), pointer(grad_depth), pointer(grad_features)};
  const SceneGradients out{d_means.data(),   d_log_scales.data(), d_quats.data(), d_logits.data(),
                           d_colours.data(), pointer(d_features), d_camera.data()};
  nb::gil_scoped_release release;
  context.backward(scene, pictures, given, out, threads);
}

void contributions(Context& context, In map, Out total, Out maximum, Out mapped, int threads) {
  Scene scene{};
  scene.n = total.shape(0);
  const Images images{int(map.shape(1)), int(map.shape(0)), int(map.shape(2)), 0, 0, unread(map), nullptr, nullptr};
  nb::gil_scoped_release release;
  context.contributions(scene, images, {total.data(), maximum.data(), mapped.data()}, threads);
}

double loss(const std::string& isa, In image, In target, MaybeIn weight, float structure, Out gradient, int threads) {
  const Kernels& kernels = kernels_of(isa);
  const int height = image.shape(0), width = image.shape(1), channels = image.shape(2);
  nb::gil_scoped_release release;
  LossTask task{width,           height,    channels,        image.data(), target.data(),
                pointer(weight), structure, gradient.data(), nullptr,      nullptr};
  const std::unique_ptr<float[]> scratch(new float[4 * size_t(height) * loss_stride(task)]);
  std::vector<double> rows(height);
  task.scratch = scratch.get();
  task.row_sums = rows.data();
  kernels.loss(task, threads);
  double total = 0;
  for (double row : rows) total += row;
  return total / double(image.size());
}

// rates: one for all, or one a column
void adam(const std::string& isa, Out values, In gradient, Out first, Out second, std::optional<Rows> moved, int step,
          In rates, double beta1, double beta2, float epsilon, int threads) {
  const Kernels& kernels = kernels_of(isa);
  const size_t rows = values.ndim() ? values.shape(0) : 1;
  const int columns = rows ? int(values.size() / rows) : 0;
  const bool each = rates.size() > 1;
  nb::gil_scoped_release release;
  std::vector<float> pattern(each ? PATTERN * columns : 0);
  for (size_t i = 0; i < pattern.size(); i++) pattern[i] = rates.data()[i % columns];
  kernels.adam(
      {rows, columns, values.data(), gradient.data(), first.data(), second.data(), moved ? moved->data() : nullptr,
       each ? 0 : rates.data()[0], each ? pattern.data() : nullptr, float(beta1), float(beta2), epsilon,
       float(1 / (1 - std::pow(beta1, step))), float(1 / (1 - std::pow(beta2, step)))},
      threads);
}

// camera: rotation (9), translation (3), fx, fy, cx, cy
void add_photo(In image, In weight, In camera, In points, In heights, Out total, Out squares, Out count, int threads) {
  const float *from = camera.data(), *lens = from + 12;
  const Photo photo{
      image.data(), weight.data(), int(image.shape(1)), int(image.shape(0)), lens[0], lens[1], lens[2], lens[3],
      from,         from + 9};
  nb::gil_scoped_release release;
  const ThreadAffinity affinity(threads);
  raster::add_colours(photo, points.data(), points.shape(0), heights.data(), heights.shape(0),
                      {total.data(), squares.data(), count.data()}, threads);
}

// Fused multiply-adds a second that threads do together, for about `seconds`; the best of some tries.
double peak(const std::string& isa, double seconds, int threads) {
  const Kernels& kernels = kernels_of(isa);
  nb::gil_scoped_release release;
  using Clock = std::chrono::steady_clock;
  long rounds = 1 << 14;
  double best = 0, spent = 0;
  while (spent < seconds) {
    const auto start = Clock::now();
    const double done = kernels.peak(rounds, threads);
    const double took = std::chrono::duration<double>(Clock::now() - start).count();
    best = std::max(best, done / took);
    spent += took;
    if (took < seconds / 20) rounds *= 2;
  }
  return best;
}

}  // namespace

NB_MODULE(_core, m) {
  m.def("instruction_sets", [] {
    std::vector<std::string> names;
    for (const Kernels* k : available_kernels()) names.push_back(k->name);
    return names;
  });
  nb::class_<Context>(m, "Context")
      .def("__init__", [](Context* at, const std::string& isa) { new (at) Context(kernels_of(isa)); })
      .def_prop_ro("intersections", &Context::intersections)
      .def("forward", &forward)
      .def("backward", &backward)
      .def("contributions", &contributions)
      .def("drawn", [](const Context& context, Flags out) { context.visible(out.size(), out.data()); })
      .def("pairs", &Context::pairs)
      .def_prop_ro("seconds", [](const Context& context) {
        nb::dict found;
        for (int stage = 0; stage < STAGES; stage++) found[STAGE_NAMES[stage]] = context.seconds()[stage];
        return found;
      });
  m.def("loss", &loss);
  m.def("adam", &adam);
  m.def("peak", &peak);
  m.def("add_colours", &add_photo);
}
