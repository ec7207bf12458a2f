// What a shard makes of one run: its samples as the model holds them, one after the other, and their sums.
#pragma once

#include "precompute/basis/kept_variance.hpp"
#include "precompute/jobs/bake_plan.hpp"

#include <cstddef>
#include <cstdint>
#include <vector>

namespace lbea::bake {

/// One sample's rows of the model's sections.
struct SampleRecord {
  std::vector<float> positions;                            // N x 3
  std::vector<std::vector<float>> fields;                  // [field][element]
  std::vector<std::vector<float>> coefficients;            // [reference][axis x padded mode]
  std::vector<std::vector<std::uint32_t>> correspondence;  // [reference][vertex]; empty without VtP

  SampleRecord(const BakePlan& plan, const std::vector<ReferenceBasis>& bases);
  [[nodiscard]] std::size_t bytes() const;
};

void write_sample(WorkWriter& file, const SampleRecord& sample);
void read_sample(WorkReader& file, SampleRecord& sample);

/// Behind the last sample; one per reference.
void write_moments(WorkWriter& file, const std::vector<Moments>& moments);
[[nodiscard]] std::vector<Moments> read_moments(WorkReader& file);

}  // namespace lbea::bake
