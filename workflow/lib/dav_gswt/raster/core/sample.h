// Colours of points in photos, summed over the photos: what the plane sweep compares.
#pragma once
#include <cstddef>

namespace raster {

// image: rows of 3 floats a pixel; weight: 0 where the photo does not count. cx, cy: from the first pixel's corner.
// A point p of the world is at rotation p + translation in the photo's frame.
struct Photo {
  const float *image, *weight;
  int width, height;
  float fx, fy, cx, cy;
  const float *rotation, *translation;
};

// By height and point: sum of the colours, of their squares' sums, and number of photos.
struct ColourSums {
  float *total, *squares, *count;
};

// Adds a photo's bilinear colours at points of the world, 3 floats each, moved up by each of `heights`, where the photo
// sees them: a point has a pixel on each side, and the photo counts at the first of them.
void add_colours(const Photo& photo, const float* points, size_t n, const float* heights, size_t m,
                 const ColourSums& sums, int threads);

}  // namespace raster
