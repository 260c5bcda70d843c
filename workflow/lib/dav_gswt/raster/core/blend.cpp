// Splats over pixels, front to back, a tile at a time; and the gradient in the same order, so that no list of what a
// pixel saw has to be kept.
//
// Backward: a pixel's loss gradient along the colour that comes from behind splat i is
// rem_i = sum_{j > i} w_j (c_j . g) + light . g_light, which starts as the whole picture's and loses one term a splat:
// d loss / d alpha_i = light_i (c_i . g) - rem_i / (1 - alpha_i). Per tile and splat only moments of that over x and y
// are summed; means and conic gradients follow from them once. Each (tile, splat) writes its own record, and records
// are added per Gaussian in the order of its slots: the same bits for any number of threads.
#include <algorithm>
#include <cmath>
#include <cstring>

#include "types.h"
#include "vectors.h"

namespace dav::ISA {
namespace {

constexpr int PARTS = TILE / VECTOR;  // vectors a row of a tile
constexpr float LOG2_E = 1.4426950408889634f;
constexpr float LOG2_LEAST = -7.994353437f;  // log2(1/255)
constexpr int CHECK = 16;                    // splats between two looks at which rows are finished

vf lanes() {
  vf v;
  for (int i = 0; i < VECTOR; i++) v[i] = i + 0.5f;
  return v;
}

// The light left at each pixel of a tile; negative: finished (its size is still what passes), or outside the picture.
struct Light {
  vf left[TILE][PARTS];
  int first = 0, last = TILE - 1;  // rows that are not finished

  void open(int x0, int y0, int width, int height) {
    vf lane = lanes();
    for (int y = 0; y < TILE; y++)
      for (int part = 0; part < PARTS; part++) {
        vi inside = lane + (float)(x0 + part * VECTOR) < all((float)width);
        left[y][part] = y0 + y < height ? (inside ? all(1.f) : all(-1.f)) : all(-1.f);
      }
  }
  bool finished(int y) const {
    vi some = {};
    for (int part = 0; part < PARTS; part++) some |= left[y][part] > 0.f;
    return !any(some);
  }
  bool all_finished() {
    while (first <= last && finished(first)) first++;
    while (first <= last && finished(last)) last--;
    return first > last;
  }
};

// A splat's exponent over a tile, log2 alpha = e0 + e1 dy + e2 dy^2 a column.
struct Rows {
  int from, to;
  float half_c;
  vf half_a, b;
  Rows(const Splat &s, const Light &light, int y0)
      : from((int)std::ceil(std::max((float)light.first, s.y - s.reach_y - y0 - 0.5f))),
        to((int)std::floor(std::min((float)light.last, s.y + s.reach_y - y0 - 0.5f))),
        half_c(-0.5f * LOG2_E * s.c), half_a(all(-0.5f * LOG2_E * s.a)), b(all(-LOG2_E * s.b)) {}
};

bool beside(const Splat &s, float x) { return PARTS > 1 && (s.x + s.reach_x < x || s.x - s.reach_x > x + VECTOR); }

struct Alpha {
  vf value, weight;
  vi drawn, clamped;
};

// Alpha of a splat at one vector of pixels, and the light left after it. False: none of them is touched.
bool meet(vf exponent, vf &left, Alpha &a) {
  vf light = left;
  vi live = (exponent >= all(LOG2_LEAST)) & (light > 0.f);
  if (!any(live)) return false;
  vf value = exp2_of(exponent > all(-8.f) ? exponent : all(-8.f));
  a.clamped = value >= all(MOST_ALPHA);
  a.value = a.clamped ? all(MOST_ALPHA) : value;
  vf weight = a.value * light, after = light - weight;
  a.drawn = live & (after >= all(LEAST_LIGHT));
  a.weight = a.drawn ? weight : all(0.f);
  left = a.drawn ? after : (live ? -light : light);
  return true;
}

void prefetch(const Splat *splats, const Bins &bins, uint32_t k) {
  __builtin_prefetch(&splats[bins.splat[std::min<size_t>(k + 6, bins.splat.size() - 1)]]);
}

void blend_tile(const Splat *splats, const Bins &bins, const Image &image, int tile) {
  int x0 = tile % bins.columns * TILE, y0 = tile / bins.columns * TILE, count = 0;
  const vf lane = lanes();
  Light light;
  light.open(x0, y0, image.width, image.height);
  vf red[TILE][PARTS] = {}, green[TILE][PARTS] = {}, blue[TILE][PARTS] = {}, depth[TILE][PARTS] = {};
  for (uint32_t k = bins.tile_start[tile]; k < bins.tile_start[tile + 1]; k++) {
    const Splat &s = splats[bins.splat[k]];
    prefetch(splats, bins, k);
    Rows rows(s, light, y0);
    for (int part = 0; part < PARTS; part++) {
      float x = x0 + part * VECTOR;
      if (beside(s, x)) continue;
      vf dx = lane + (x - s.x), e0 = rows.half_a * dx * dx + s.log2_opacity, e1 = rows.b * dx;
      for (int y = rows.from; y <= rows.to; y++) {
        float dy = y0 + y + 0.5f - s.y;
        Alpha a;
        if (!meet(e0 + e1 * dy + rows.half_c * dy * dy, light.left[y][part], a)) continue;
        red[y][part] += a.weight * s.red;
        green[y][part] += a.weight * s.green;
        blue[y][part] += a.weight * s.blue;
        depth[y][part] += a.weight * s.depth;
      }
    }
    if (++count % CHECK == 0 && light.all_finished()) break;
  }
  for (int y = 0; y < TILE && y0 + y < image.height; y++)
    for (int x = 0; x < TILE && x0 + x < image.width; x++) {
      size_t pixel = (size_t)(y0 + y) * image.width + x0 + x;
      int part = x / VECTOR, l = x % VECTOR;
      image.light[pixel] = std::fabs(light.left[y][part][l]);
      image.depth[pixel] = depth[y][part][l];
      image.colour[3 * pixel] = red[y][part][l];
      image.colour[3 * pixel + 1] = green[y][part][l];
      image.colour[3 * pixel + 2] = blue[y][part][l];
    }
}

struct TileGradient {
  vf red[TILE][PARTS], green[TILE][PARTS], blue[TILE][PARTS], depth[TILE][PARTS], rest[TILE][PARTS];

  void open(const Image &image, const ImageGradient &g, int x0, int y0) {
    for (int y = 0; y < TILE; y++)
      for (int x = 0; x < TILE; x++) {
        bool inside = x0 + x < image.width && y0 + y < image.height;
        size_t pixel = inside ? (size_t)(y0 + y) * image.width + x0 + x : 0;
        int part = x / VECTOR, l = x % VECTOR;
        const float *c = image.colour + 3 * pixel, *gc = g.colour + 3 * pixel;
        float gd = g.depth ? g.depth[pixel] : 0.f, gl = g.light ? g.light[pixel] : 0.f;
        red[y][part][l] = inside ? gc[0] : 0.f;
        green[y][part][l] = inside ? gc[1] : 0.f;
        blue[y][part][l] = inside ? gc[2] : 0.f;
        depth[y][part][l] = inside ? gd : 0.f;
        rest[y][part][l] = inside ? c[0] * gc[0] + c[1] * gc[1] + c[2] * gc[2] + image.depth[pixel] * gd + image.light[pixel] * gl : 0.f;
      }
  }
};

void blend_backward_tile(const Splat *splats, const Bins &bins, const Image &image, const ImageGradient &gradient,
                         int tile, float *records) {
  int x0 = tile % bins.columns * TILE, y0 = tile / bins.columns * TILE, count = 0;
  const vf lane = lanes();
  Light light;
  light.open(x0, y0, image.width, image.height);
  TileGradient g;
  g.open(image, gradient, x0, y0);
  uint32_t k = bins.tile_start[tile], end = bins.tile_start[tile + 1];
  while (k < end) {
    const Splat &s = splats[bins.splat[k]];
    prefetch(splats, bins, k);
    Rows rows(s, light, y0);
    vf m = {}, mx = {}, mxx = {}, my = {}, mxy = {}, myy = {}, red = {}, green = {}, blue = {}, depth = {};
    for (int part = 0; part < PARTS; part++) {
      float x = x0 + part * VECTOR;
      if (beside(s, x)) continue;
      vf dx = lane + (x - s.x), e0 = rows.half_a * dx * dx + s.log2_opacity, e1 = rows.b * dx;
      vf v0 = {}, v1 = {}, v2 = {};
      for (int y = rows.from; y <= rows.to; y++) {
        float dy = y0 + y + 0.5f - s.y;
        Alpha a;
        vf before = light.left[y][part];
        if (!meet(e0 + e1 * dy + rows.half_c * dy * dy, light.left[y][part], a)) continue;
        vf along = g.red[y][part] * s.red + g.green[y][part] * s.green + g.blue[y][part] * s.blue + g.depth[y][part] * s.depth;
        vf rest = g.rest[y][part] -= a.weight * along;
        vf v = a.value * (before * along - rest / (1.f - a.value));
        v = (a.drawn & ~a.clamped) ? v : all(0.f);
        v0 += v;
        v1 += v * dy;
        v2 += v * (dy * dy);
        red += a.weight * g.red[y][part];
        green += a.weight * g.green[y][part];
        blue += a.weight * g.blue[y][part];
        depth += a.weight * g.depth[y][part];
      }
      vf v0x = v0 * dx;
      m += v0, mx += v0x, mxx += v0x * dx, my += v1, mxy += v1 * dx, myy += v2;
    }
    float *out = records + (size_t)bins.slot[k] * SPLAT_GRADIENTS, sx = sum(mx), sy = sum(my);
    out[G_X] = s.a * sx + s.b * sy;
    out[G_Y] = s.b * sx + s.c * sy;
    out[G_A] = -0.5f * sum(mxx);
    out[G_B] = -sum(mxy);
    out[G_C] = -0.5f * sum(myy);
    out[G_OPACITY] = sum(m) / s.opacity;
    out[G_RED] = sum(red), out[G_GREEN] = sum(green), out[G_BLUE] = sum(blue), out[G_DEPTH] = sum(depth);
    k++;
    if (++count % CHECK == 0 && light.all_finished()) break;
  }
  for (; k < end; k++) std::memset(records + (size_t)bins.slot[k] * SPLAT_GRADIENTS, 0, SPLAT_GRADIENTS * sizeof(float));
}

}  // namespace

void blend(const Splat *splats, const Bins &bins, Image image, int threads) {
  int tiles = bins.columns * bins.rows;
#pragma omp parallel for num_threads(threads) schedule(dynamic, 2)
  for (int tile = 0; tile < tiles; tile++) blend_tile(splats, bins, image, tile);
}

void blend_backward(int n, const Splat *splats, const Bins &bins, const Image &image, ImageGradient gradient,
                    std::vector<float> &records, float *splat_gradients, int threads) {
  int tiles = bins.columns * bins.rows;
  records.resize(bins.splat.size() * SPLAT_GRADIENTS);
#pragma omp parallel for num_threads(threads) schedule(dynamic, 2)
  for (int tile = 0; tile < tiles; tile++) blend_backward_tile(splats, bins, image, gradient, tile, records.data());
#pragma omp parallel for num_threads(threads) schedule(static)
  for (int i = 0; i < n; i++) {
    float total[SPLAT_GRADIENTS] = {};
    for (size_t slot = bins.slot_start[i]; slot < bins.slot_start[i + 1]; slot++)
      for (int k = 0; k < SPLAT_GRADIENTS; k++) total[k] += records[slot * SPLAT_GRADIENTS + k];
    std::memcpy(splat_gradients + (size_t)SPLAT_GRADIENTS * i, total, sizeof total);
  }
}

}  // namespace dav::ISA
