// Benchmark: the peak rate of fused multiply-adds, on values that never leave the registers.
#include "kernels.h"
#include "lanes.h"

namespace raster {
namespace ISA {

constexpr int CHAINS = 12;  // independent, so that none waits for its last result; and they fit the registers

static Lanes work(long rounds, float start) {
  Lanes v[CHAINS];
  for (int i = 0; i < CHAINS; i++) v[i] = all(start + i);
  const Lanes factor = all(0.999f), more = all(0.001f);  // towards 1, never towards the slow denormal numbers
  for (long r = 0; r < rounds; r++)
    for (int i = 0; i < CHAINS; i++) v[i] = v[i] * factor + more;
  Lanes sum = v[0];
  for (int i = 1; i < CHAINS; i++) sum += v[i];
  return sum;
}

double peak(long rounds, int threads) {
  float kept = 0;
#pragma omp parallel for num_threads(threads) schedule(static) reduction(+ : kept)
  for (int t = 0; t < threads; t++) kept += work(rounds, t)[0];
  volatile float sink = kept;  // or the compiler would leave all of it out
  (void)sink;
  return double(rounds) * CHAINS * LANES * threads;
}

}  // namespace ISA
}  // namespace raster
