// Samples whose depth images are made by hand.
#pragma once

#include "precompute/left_out/left_out_frames.hpp"

namespace lbea::test {

struct ImageSize {
  std::uint32_t columns, rows;
};

/// All `steps` of all `runs`, whose images and nodes are still to be given; depths from 99 mm on in steps of 0.01 mm.
inline bake::SampleSource depth_samples(const ImageSize& size, std::uint32_t runs, std::uint32_t steps) {
  bake::SampleSource source;
  source.length_unit = "mm";
  source.camera.columns = size.columns;
  source.camera.rows = size.rows;
  source.camera.focal = 10;
  source.camera.depth_origin = 99;
  source.camera.depth_step = 0.01f;
  for (std::uint32_t run = 0; run < runs; ++run)
    for (std::uint32_t step = 0; step < steps; ++step) source.samples.push_back({run, step});
  return source;
}

}  // namespace lbea::test
