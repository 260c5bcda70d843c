// The Python module. Shapes and types are checked in cpu.py; here arrays become pointers, without copies.
#include "context.h"
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
using MaybeIn = std::optional<In>;

namespace {

const float* pointer(const MaybeIn& a) { return a ? a->data() : nullptr; }

// numbers: rotation (9), translation (3), fx, fy, cx, cy, near, dilation
View view_of(const In& numbers, int width, int height, bool orthographic) {
  View v;
  const float* from = numbers.data();
  std::copy(from, from + 9, v.rotation);
  std::copy(from + 9, from + 12, v.translation);
  v.fx = from[12], v.fy = from[13], v.cx = from[14], v.cy = from[15], v.near = from[16], v.dilation = from[17];
  v.width = width, v.height = height, v.orthographic = orthographic;
  return v;
}

Scene scene_of(const In& means, const In& log_scales, const In& quats, const In& logits, const In& colours) {
  return {means.shape(0), means.data(), log_scales.data(), quats.data(), logits.data(), colours.data(),
          int(colours.shape(1))};
}

// The kernels only read what they are not asked to write.
Images images_of(const In& colour, const In& alpha, const In& depth) {
  return {int(colour.shape(1)), int(colour.shape(0)), int(colour.shape(2)), 0, 0, const_cast<float*>(colour.data()),
          const_cast<float*>(alpha.data()), const_cast<float*>(depth.data())};
}

bool forward(Context& context, In means, In log_scales, In quats, In logits, In colours, In camera, int width,
             int height, bool orthographic, Out colour, Out alpha, Out depth, int threads) {
  const Images images{width, height, int(colour.shape(2)), 0, 0, colour.data(), alpha.data(), depth.data()};
  const Scene scene = scene_of(means, log_scales, quats, logits, colours);
  const View view = view_of(camera, width, height, orthographic);
  nb::gil_scoped_release release;
  return context.forward(scene, view, images, threads);
}

void backward(Context& context, In means, In log_scales, In quats, In logits, In colours, In colour, In alpha,
              In depth, In grad_colour, MaybeIn grad_alpha, MaybeIn grad_depth, Out d_means, Out d_log_scales,
              Out d_quats, Out d_logits, Out d_colours, int threads) {
  const Scene scene = scene_of(means, log_scales, quats, logits, colours);
  const Images images = images_of(colour, alpha, depth);
  const ImageGradients gradients{grad_colour.data(), pointer(grad_alpha), pointer(grad_depth)};
  const SceneGradients out{d_means.data(), d_log_scales.data(), d_quats.data(), d_logits.data(), d_colours.data()};
  nb::gil_scoped_release release;
  context.backward(scene, images, gradients, out, threads);
}

void contributions(Context& context, In map, Out total, Out maximum, Out mapped, int threads) {
  Scene scene{};
  scene.n = total.shape(0);
  const Images images{int(map.shape(1)), int(map.shape(0)), int(map.shape(2)), 0, 0,
                      const_cast<float*>(map.data()), nullptr, nullptr};
  nb::gil_scoped_release release;
  context.contributions(scene, images, total.data(), maximum.data(), mapped.data(), threads);
}

double loss(const std::string& isa, In image, In target, MaybeIn weight, float structure, Out gradient, int threads) {
  const Kernels& kernels = kernels_of(isa);
  const int height = image.shape(0), width = image.shape(1), channels = image.shape(2);
  nb::gil_scoped_release release;
  LossTask task{width, height, channels, image.data(), target.data(), pointer(weight), structure, gradient.data(),
                nullptr, nullptr};
  const std::unique_ptr<float[]> scratch(new float[4 * size_t(height) * loss_stride(task)]);
  std::vector<double> rows(height);
  task.scratch = scratch.get();
  task.row_sums = rows.data();
  kernels.loss(task, threads);
  double total = 0;
  for (double row : rows) total += row;
  return total / double(image.size());
}

void adam(const std::string& isa, Out values, In gradient, Out first, Out second, std::optional<Rows> moved, int step,
          float rate, double beta1, double beta2, float epsilon, int threads) {
  const Kernels& kernels = kernels_of(isa);
  const size_t rows = values.ndim() ? values.shape(0) : 1;
  const int columns = rows ? int(values.size() / rows) : 0;
  nb::gil_scoped_release release;
  kernels.adam({rows, columns, values.data(), gradient.data(), first.data(), second.data(),
                moved ? moved->data() : nullptr, rate, float(beta1), float(beta2), epsilon,
                float(1 / (1 - std::pow(beta1, step))), float(1 / (1 - std::pow(beta2, step)))},
               threads);
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
      .def("contributions", &contributions);
  m.def("loss", &loss);
  m.def("adam", &adam);
}
