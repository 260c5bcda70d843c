// Vectors of VECTOR floats by GCC's extensions: the same source for SSE, AVX2, AVX-512 and anything else.
#pragma once
#include <cstring>
#if defined(__x86_64__)
#include <immintrin.h>
#endif

namespace dav::ISA {

typedef float vf __attribute__((vector_size(VECTOR * 4)));
typedef int vi __attribute__((vector_size(VECTOR * 4)));

static inline vf load(const float *from) {
  vf v;
  std::memcpy(&v, from, sizeof v);
  return v;
}
static inline void store(float *to, vf v) { std::memcpy(to, &v, sizeof v); }
static inline vf all(float x) { return vf{} + x; }

static inline bool any(vi mask) {
#if VECTOR == 16 && defined(__AVX512F__)
  return _mm512_test_epi32_mask((__m512i)mask, (__m512i)mask) != 0;
#elif VECTOR == 8 && defined(__AVX__)
  return !_mm256_testz_si256((__m256i)mask, (__m256i)mask);
#else
  int found = 0;
  for (int i = 0; i < VECTOR; i++) found |= mask[i];
  return found != 0;
#endif
}

static inline float sum(vf v) {
  float total = 0;
  for (int i = 0; i < VECTOR; i++) total += v[i];
  return total;
}

// 2^x for x in [-100, 0], relative error below 3e-7: round to an integer by adding 1.5 * 2^23, a polynomial for the
// rest. Needs -fno-associative-math, or the compiler folds (x + magic) - magic.
static inline vf exp2_of(vf x) {
  const float magic = 12582912.f;
  vf shifted = x + magic;
  vi exponent = (vi)shifted;
  vf f = x - (shifted - magic);
  vf p = f * 1.3333558e-3f + 9.6181291e-3f;
  p = p * f + 5.5504109e-2f;
  p = p * f + 2.4022651e-1f;
  p = p * f + 6.9314718e-1f;
  p = p * f + 1.0f;
  return (vf)((vi)p + (exponent << 23));
}

}  // namespace dav::ISA
