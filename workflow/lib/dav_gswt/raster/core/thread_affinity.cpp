#include "thread_affinity.h"
#if defined(__linux__)
#include <omp.h>

namespace raster {

ThreadAffinity::ThreadAffinity(int threads) {
  const int own = sched_getcpu();
  cpu_set_t others;
  if (threads < 2 || own < 0 || sched_getaffinity(0, sizeof others, &others) != 0) return;
  CPU_CLR(own, &others);
  if (CPU_COUNT(&others) == 0) return;
  before_.resize(threads);
#pragma omp parallel num_threads(threads)
  {
    const int thread = omp_get_thread_num();
    if (sched_getaffinity(0, sizeof(cpu_set_t), &before_[thread]) != 0) CPU_ZERO(&before_[thread]);
    if (thread > 0) sched_setaffinity(0, sizeof others, &others);
  }
}

ThreadAffinity::~ThreadAffinity() {
  if (before_.empty()) return;
#pragma omp parallel num_threads(int(before_.size()))
  {
    const int thread = omp_get_thread_num();
    if (thread > 0 && CPU_COUNT(&before_[thread]) > 0) sched_setaffinity(0, sizeof(cpu_set_t), &before_[thread]);
  }
}

}  // namespace raster
#else
namespace raster {
ThreadAffinity::ThreadAffinity(int) {}
ThreadAffinity::~ThreadAffinity() {}
}  // namespace raster
#endif
