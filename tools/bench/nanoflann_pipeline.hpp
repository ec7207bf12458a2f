// A baseline from libraries: what a user would write first.
#pragma once

#include "runtime/src/match/cloud_index.hpp"
#include "tools/bench/pipeline.hpp"

#include <Eigen/Core>

namespace lbea::tool::bench {

/// The points of a frame inside the envelope, in reference coordinates.
struct PlacedPoints {
  std::vector<std::array<float, 3>> positions;
  std::vector<std::uint32_t> places;  // in the frame
};

/// A nanoflann tree per frame, Eigen's matrix product, a loop over all samples. No coverage.
class NanoflannPipeline : public Pipeline {
 public:
  NanoflannPipeline(const Model& model, const MatcherConfig& config);

  [[nodiscard]] std::string name() const override { return "nanoflann"; }
  PipelineTimes match(const Frame& frame) override;
  [[nodiscard]] Answer answer(const Frame& frame) override;

  // Of the last frame:
  [[nodiscard]] const PlacedPoints& points() const noexcept { return points_; }
  [[nodiscard]] std::span<const RankedSample> ranked() const noexcept { return ranked_; }

 private:
  using RowMajor = Eigen::Matrix<float, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

  void place(std::span<const Point> points);
  [[nodiscard]] bool inside(const std::array<float, 3>& position) const;
  template <typename Tree>
  void correspond(const Tree& tree, const ReferenceView& reference);
  void project(const ReferenceView& reference);
  void measure_lbea(const ReferenceView& reference);
  void measure_vtp(const ReferenceView& reference);
  void rank();

  Model model_;
  const ModelView& view_;
  MatcherConfig config_;
  CellGrid grid_;
  PlacedPoints points_;
  RowMajor corresponding_, coefficients_;
  std::vector<std::uint32_t> nearest_;
  std::vector<float> distances_;
  std::vector<RankedSample> ranked_;
  std::uint32_t reference_ = 0;
};

/// The `count` least distances, ascending; ties go to the lower index.
[[nodiscard]] std::vector<RankedSample> least(std::vector<RankedSample> samples, std::size_t count);

}  // namespace lbea::tool::bench
