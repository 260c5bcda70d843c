#include "keep_apart.h"
#if defined(__linux__)
#include <omp.h>
#include <sched.h>

namespace raster {

int keep_apart(int threads, int before) {
  const int mine = sched_getcpu();
  cpu_set_t others;
  if (threads < 2 || mine < 0 || mine == before || sched_getaffinity(0, sizeof others, &others) != 0) return before;
  CPU_CLR(mine, &others);
  if (CPU_COUNT(&others) == 0) return mine;
#pragma omp parallel num_threads(threads)
  if (omp_get_thread_num() > 0) sched_setaffinity(0, sizeof others, &others);
  return mine;
}

}  // namespace raster
#else
namespace raster {
int keep_apart(int, int before) { return before; }
}  // namespace raster
#endif
