// Vectors of LANES floats, and the few operations on them that the compilers' vector extension lacks.
#pragma once
#include "types.h"
#include <string.h>
#if defined(__x86_64__)
#include <immintrin.h>
#endif

namespace raster {
namespace ISA {

typedef float Lanes __attribute__((vector_size(LANES * 4)));
typedef int Whole __attribute__((vector_size(LANES * 4)));

static inline Lanes all(float value) { return Lanes{} + value; }

static inline Lanes load(const float* from) {
  Lanes v;
  memcpy(&v, from, sizeof v);
  return v;
}

static inline void store(float* to, Lanes v) { memcpy(to, &v, sizeof v); }

// A Mask says yes or no for every lane. AVX-512 has registers of its own for that; elsewhere it is -1 or 0 in a lane.
#if LANES == 16 && defined(__AVX512F__)
typedef __mmask16 Mask;
static inline Mask at_least(Lanes a, Lanes b) { return _mm512_cmp_ps_mask((__m512)a, (__m512)b, _CMP_GE_OQ); }
static inline Mask below(Lanes a, Lanes b) { return _mm512_cmp_ps_mask((__m512)a, (__m512)b, _CMP_LT_OQ); }
static inline Mask mask_of(Whole lanes) { return _mm512_movepi32_mask((__m512i)lanes); }
static inline bool any(Mask m) { return m != 0; }
static inline bool every(Mask m) { return m == 0xffff; }
static inline Lanes select(Mask m, Lanes yes, Lanes no) {
  return (Lanes)_mm512_mask_mov_ps((__m512)no, m, (__m512)yes);
}
static inline Lanes where(Mask m, Lanes v) { return (Lanes)_mm512_maskz_mov_ps(m, (__m512)v); }  // v or 0
static inline Lanes max(Lanes a, Lanes b) { return (Lanes)_mm512_maskz_max_ps(0xffff, (__m512)a, (__m512)b); }
static inline Lanes min(Lanes a, Lanes b) { return (Lanes)_mm512_maskz_min_ps(0xffff, (__m512)a, (__m512)b); }
static inline Lanes sqrt(Lanes a) { return (Lanes)_mm512_maskz_sqrt_ps(0xffff, (__m512)a); }
static inline Lanes reciprocal(Lanes a) {  // 14 bits and one Newton step: 2e-7
  const Lanes r = (Lanes)_mm512_maskz_rcp14_ps(0xffff, (__m512)a);
  return r * (2.f - a * r);
}
#else
typedef Whole Mask;
static inline Mask at_least(Lanes a, Lanes b) { return a >= b; }
static inline Mask below(Lanes a, Lanes b) { return a < b; }
static inline Mask mask_of(Whole lanes) { return lanes; }
static inline Lanes where(Mask m, Lanes v) { return (Lanes)((Whole)v & m); }  // v or 0
#if LANES == 8 && defined(__AVX2__)
static inline bool any(Mask m) { return !_mm256_testz_si256((__m256i)m, (__m256i)m); }
static inline Lanes select(Mask m, Lanes yes, Lanes no) {
  return (Lanes)_mm256_blendv_ps((__m256)no, (__m256)yes, (__m256)m);
}
static inline Lanes max(Lanes a, Lanes b) { return (Lanes)_mm256_max_ps((__m256)a, (__m256)b); }
static inline Lanes min(Lanes a, Lanes b) { return (Lanes)_mm256_min_ps((__m256)a, (__m256)b); }
static inline Lanes sqrt(Lanes a) { return (Lanes)_mm256_sqrt_ps((__m256)a); }
static inline Lanes reciprocal(Lanes a) {  // 12 bits and one Newton step: 2e-7
  const Lanes r = (Lanes)_mm256_rcp_ps((__m256)a);
  return r * (2.f - a * r);
}
#else
#if LANES == 4 && defined(__SSE4_1__)
static inline bool any(Mask m) { return !_mm_testz_si128((__m128i)m, (__m128i)m); }
static inline Lanes select(Mask m, Lanes yes, Lanes no) {
  return (Lanes)_mm_blendv_ps((__m128)no, (__m128)yes, (__m128)m);
}
static inline Lanes max(Lanes a, Lanes b) { return (Lanes)_mm_max_ps((__m128)a, (__m128)b); }
static inline Lanes min(Lanes a, Lanes b) { return (Lanes)_mm_min_ps((__m128)a, (__m128)b); }
#else
static inline bool any(Mask m) {
  int found = 0;
  for (int l = 0; l < LANES; l++) found |= m[l];
  return found != 0;
}
static inline Lanes select(Mask m, Lanes yes, Lanes no) { return m ? yes : no; }
static inline Lanes max(Lanes a, Lanes b) { return a > b ? a : b; }
static inline Lanes min(Lanes a, Lanes b) { return a < b ? a : b; }
#endif
static inline Lanes sqrt(Lanes a) {
  for (int l = 0; l < LANES; l++) a[l] = __builtin_sqrtf(a[l]);
  return a;
}
static inline Lanes reciprocal(Lanes a) { return 1.f / a; }
#endif
static inline bool every(Mask m) { return !any(~m); }
#endif

static inline Lanes clamp(Lanes v, float low, float high) { return min(max(v, all(low)), all(high)); }
static inline Whole finite_bits(Lanes v) { return ((Whole)v & 0x7f800000) != 0x7f800000; }  // -1 or 0
static inline Lanes negative(Lanes v) { return (Lanes)((Whole)v | (int)0x80000000); }  // -|v|

// 2^x for x in [-126, 126], relative error 2e-7. x = n + f, |f| <= 1/2: a polynomial for 2^f, n into the exponent.
// Adding 1.5 2^23 rounds to a whole number and leaves it in the low bits.
static inline Lanes exp2(Lanes x) {
  const float round = 12582912.f;
  const Lanes n = x + round;
  const Lanes f = x - (n - round);
  // Estrin's scheme: its parts do not wait for each other
  const Lanes ff = f * f;
  const Lanes high = f * 1.3333558e-3f + 9.6181291e-3f, middle = f * 5.5504109e-2f + 2.4022651e-1f;
  const Lanes p = (high * ff + middle) * ff + (f * 6.9314718e-1f + 1.f);
  return (Lanes)((Whole)p + ((Whole)n << 23));
}

static inline Lanes exp(Lanes x) { return exp2(clamp(x * LOG2_E, -126.f, 126.f)); }

// log2 of a normal positive number, absolute error 1e-7 near 1. x = 2^n m with m in [sqrt(1/2), sqrt(2)), and
// ln m = 2 atanh((m - 1) / (m + 1)) by its series.
static inline Lanes log2(Lanes x) {
  const Whole n = ((Whole)x - 0x3f3504f3) >> 23;
  const Lanes m = (Lanes)((Whole)x - (n << 23));
  const Lanes t = (m - 1.f) / (m + 1.f), tt = t * t;
  const Lanes series = 1.f + tt * (1.f / 3 + tt * (1.f / 5 + tt * (1.f / 7 + tt * (1.f / 9))));
  return __builtin_convertvector(n, Lanes) + 2.f * LOG2_E * (t * series);
}

// Lanes `from` of u, then v, as if they followed each other.
static inline Lanes shuffled(Lanes u, Lanes v, Whole from) {
#if defined(__clang__)
  Lanes out;
  for (int l = 0; l < LANES; l++) out[l] = from[l] < LANES ? u[from[l]] : v[from[l] - LANES];
  return out;
#else
  return __builtin_shuffle(u, v, from);
#endif
}

// Folding: `u` and `v` hold segments of SEGMENT lanes to be summed; the result holds segments half as long, first
// those of u, then those of v. log2(LANES) foldings turn LANES vectors into one vector of their sums.
template <int SEGMENT> static inline Lanes fold(Lanes u, Lanes v) {
  Whole low, high;
  for (int l = 0; l < LANES; l++) {
    const int half = SEGMENT / 2, segment = l / half, lane = l % half;
    low[l] = segment * SEGMENT + lane;  // counts through u, then v
    high[l] = low[l] + half;
  }
  return shuffled(u, v, low) + shuffled(u, v, high);
}

// Lane i of the result: the sum of v[i], for i < COUNT <= LANES; the other lanes mean nothing.
template <int SEGMENT, int COUNT> static inline Lanes fold_all(const Lanes* v) {
  constexpr int HALF = LANES / SEGMENT;  // how many vectors go into the result's first half
  if constexpr (SEGMENT == 2 * LANES) {
    return *v;
  } else {
    const Lanes u = fold_all<2 * SEGMENT, (COUNT < HALF ? COUNT : HALF)>(v);
    if constexpr (COUNT <= HALF) return fold<SEGMENT>(u, u);
    else return fold<SEGMENT>(u, fold_all<2 * SEGMENT, COUNT - HALF>(v + HALF));
  }
}

template <int COUNT> __attribute__((noinline)) static void store_sums_of(float* to, const Lanes* v) {
  constexpr int NOW = COUNT < LANES ? COUNT : LANES;
  const Lanes sums = fold_all<2, NOW>(v);
  memcpy(to, &sums, 4 * NOW);
  if constexpr (COUNT > LANES) store_sums_of<COUNT - LANES>(to + LANES, v + LANES);
}

// to[i] = sum of the lanes of v[i], for COUNT vectors. The folding is not inlined, and gets a copy, so that the loop
// before it may keep v in registers.
template <int COUNT> static inline void store_sums(float* to, const Lanes* v) {
  Lanes copy[COUNT];
  for (int i = 0; i < COUNT; i++) copy[i] = v[i];
  store_sums_of<COUNT>(to, copy);
}

// Rows of `stride` floats: the first floats of rows `row`, `row + 1` ... as lanes, and back. With fewer than LANES
// rows left the last one is repeated.
static inline Lanes load_column(const float* column, int stride, size_t row, int rows) {
  float buffer[LANES];
  column += row * stride;
  if (rows >= LANES)
    for (int l = 0; l < LANES; l++) buffer[l] = column[l * stride];
  else
    for (int l = 0; l < LANES; l++) buffer[l] = column[(l < rows ? l : rows - 1) * stride];
  return load(buffer);
}

// The three columns of LANES rows of 3 floats that follow each other.
static inline void load_triples(const float* rows, Lanes out[3]) {
  const Lanes u = load(rows), v = load(rows + LANES), w = load(rows + 2 * LANES);
  for (int k = 0; k < 3; k++) {
    Whole early, late;  // from u and v; then what lies in w
    for (int l = 0; l < LANES; l++) {
      const int at = 3 * l + k;
      early[l] = at < 2 * LANES ? at : 0;
      late[l] = at < 2 * LANES ? l : at - LANES;
    }
    out[k] = shuffled(shuffled(u, v, early), w, late);
  }
}

static inline void store_column(float* column, int stride, size_t row, int rows, Lanes v) {
  float buffer[LANES];
  store(buffer, v);
  column += row * stride;
  if (rows >= LANES)
    for (int l = 0; l < LANES; l++) column[l * stride] = buffer[l];
  else
    for (int l = 0; l < rows; l++) column[l * stride] = buffer[l];
}

}  // namespace ISA
}  // namespace raster
