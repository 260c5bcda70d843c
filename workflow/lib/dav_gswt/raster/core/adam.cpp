// Adam (Kingma & Ba 2015), one pass over an array: moments, bias correction and step together.
#include "kernels.h"
#include <string.h>

namespace raster {
namespace ISA {

// Elements first ... last - 1. With rates by column, `first` begins a row and they are at most a pattern's length.
template <bool EACH> static inline void step(const AdamTask& task, size_t first, size_t last) {
  float* __restrict values = task.values + first;
  float* __restrict m = task.first + first;
  float* __restrict v = task.second + first;
  const float* __restrict gradient = task.gradient + first;
  const float* __restrict rates = task.rates;
  const float beta1 = task.beta1, beta2 = task.beta2, common = task.rate, correction1 = task.correction1;
  const float correction2 = task.correction2, epsilon = task.epsilon;
#pragma omp simd
  for (size_t i = 0; i < last - first; i++) {
    const float g = gradient[i], rate = (EACH ? rates[i] : common) * correction1;
    m[i] = beta1 * m[i] + (1 - beta1) * g;
    v[i] = beta2 * v[i] + (1 - beta2) * g * g;
    values[i] -= rate * m[i] / (__builtin_sqrtf(v[i] * correction2) + epsilon);
  }
}

static void step_rows(const AdamTask& task, size_t begin, size_t end) {
  if (!task.rates) return step<false>(task, begin * task.columns, end * task.columns);
  for (size_t row = begin; row < end; row += PATTERN)
    step<true>(task, row * task.columns, (row + PATTERN < end ? row + PATTERN : end) * task.columns);
}

void adam(const AdamTask& task, int threads) {
  const ptrdiff_t chunk = 1024, chunks = (task.rows + chunk - 1) / chunk;
#pragma omp parallel for num_threads(threads) schedule(static)
  for (ptrdiff_t c = 0; c < chunks; c++) {
    const size_t begin = c * chunk, end = begin + chunk < task.rows ? begin + chunk : task.rows;
    if (!task.moved) {
      step_rows(task, begin, end);
      continue;
    }
    const bool* at = task.moved + begin;
    const bool* const last = task.moved + end;
    while ((at = (const bool*)memchr(at, true, last - at))) {  // runs of rows that move
      const bool* run_end = (const bool*)memchr(at, false, last - at);
      if (!run_end) run_end = last;
      step_rows(task, at - task.moved, run_end - task.moved);
      if ((at = run_end) == last) break;
    }
  }
}

}  // namespace ISA
}  // namespace raster
