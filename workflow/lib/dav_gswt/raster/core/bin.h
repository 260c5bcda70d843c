// Binning: the splats of each tile, front to back.
#pragma once
#include "types.h"
#include <vector>

namespace raster {

// The lists and their working memory, which is kept between calls.
class Binning {
 public:
  // Lists the splats of every tile of a width x height picture. Throws std::length_error beyond 2^31 intersections.
  void sort(const Splat* splats, size_t n, int width, int height, int threads);
  Tiles tiles() { return {columns_, rows_, first_.data(), splat_.data(), slot_.data(), blocks_.data(), slots_.data()}; }
  const uint32_t* slots() const { return slots_.data(); }
  size_t intersections() const { return splat_.size(); }

 private:
  void count(const Splat* splats, size_t n, int threads);
  void order_by_depth(int threads);
  void distribute(const Splat* splats, int threads);

  int columns_ = 0, rows_ = 0;
  std::vector<uint32_t> first_, splat_, slot_, slots_;
  std::vector<uint32_t> tile_of_slot_;
  std::vector<uint64_t> blocks_;
  std::vector<uint64_t> keys_, spare_keys_;  // depth above, splat below
  std::vector<uint32_t> histogram_;
};

}  // namespace raster
