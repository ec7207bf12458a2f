// Where a run can be met and what it looks like from the sensor: of its record, what also depends on the whole
// ensemble's place and the sensor's pose, and is made anew when they change, without the run.
#pragma once

#include "precompute/depth_images/view_renderer.hpp"
#include "precompute/jobs/run_record.hpp"
#include "precompute/survey/envelope.hpp"

#include <cstddef>
#include <cstdint>
#include <vector>

namespace lbea::bake {

/// From the run's finished record. renderer: null when the plan has no camera.
void make_footprint(const WorkFolder& work, const BakePlan& plan, std::size_t run, SampleRecord& buffer,
                    const ViewRenderer* renderer);

/// Reads the depth images one by one, then the envelope's bits.
class FootprintReader {
 public:
  FootprintReader(const WorkFolder& work, const BakePlan& plan, std::size_t run);
  void image(std::span<std::uint16_t> image) { file_.bytes(std::as_writable_bytes(image)); }
  /// After the run's last image.
  void envelope(EnvelopeBuilder& into);

 private:
  WorkReader file_;
};

}  // namespace lbea::bake
