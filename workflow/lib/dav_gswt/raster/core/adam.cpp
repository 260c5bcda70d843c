// Adam (Kingma & Ba 2015), one pass over an array: moments, bias correction and step together.
#include "kernels.h"

namespace raster {
namespace ISA {

static inline void step(const AdamTask& task, size_t first, size_t last) {
  float* __restrict values = task.values;
  float* __restrict m = task.first;
  float* __restrict v = task.second;
  const float* __restrict gradient = task.gradient;
  const float beta1 = task.beta1, beta2 = task.beta2, rate = task.rate * task.correction1;
  const float correction2 = task.correction2, epsilon = task.epsilon;
#pragma omp simd
  for (size_t i = first; i < last; i++) {
    const float g = gradient[i];
    m[i] = beta1 * m[i] + (1 - beta1) * g;
    v[i] = beta2 * v[i] + (1 - beta2) * g * g;
    values[i] -= rate * m[i] / (__builtin_sqrtf(v[i] * correction2) + epsilon);
  }
}

void adam(const AdamTask& task, int threads) {
  const ptrdiff_t chunk = 4096, chunks = (task.rows + chunk - 1) / chunk;
#pragma omp parallel for num_threads(threads) schedule(static)
  for (ptrdiff_t c = 0; c < chunks; c++) {
    const size_t begin = c * chunk, end = begin + chunk < task.rows ? begin + chunk : task.rows;
    if (!task.moved) {
      step(task, begin * task.columns, end * task.columns);
      continue;
    }
    for (size_t row = begin; row < end; row++)
      if (task.moved[row]) step(task, row * task.columns, (row + 1) * task.columns);
  }
}

}  // namespace ISA
}  // namespace raster
