// Keeps the worker threads of one call off the processor of the thread that calls.
#pragma once
#include <vector>
#if defined(__linux__)
#include <sched.h>
#endif

namespace raster {

// For its lifetime, the other threads of an OpenMP team run on any processor but the caller's; then their affinity is
// what it was. Some kernels (seen in virtual machines) wake a thread on the processor of the thread that wakes it and
// leave it there: a team that sleeps while it waits is then no faster than one thread. Only on Linux; with one thread
// or one processor it does nothing.
class ThreadAffinity {
 public:
  explicit ThreadAffinity(int threads);
  ~ThreadAffinity();
  ThreadAffinity(const ThreadAffinity&) = delete;
  ThreadAffinity& operator=(const ThreadAffinity&) = delete;

#if defined(__linux__)
 private:
  std::vector<cpu_set_t> before_;  // by thread; empty where nothing was changed
#endif
};

}  // namespace raster
