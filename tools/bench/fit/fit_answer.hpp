// The check of method fit for one frame by plain loops in double precision.
#pragma once

#include "runtime/src/depth/thinned_images.hpp"
#include "tools/bench/answer.hpp"

namespace lbea::tool::bench {

/// Depth image, proposals by thinned images, and ranking of the candidates among the proposed samples. Cells whose
/// content depends on rounding, because a point is at the edge of two of them, are not compared; nor are the candidates
/// of frames of which something hides a part.
class FitCheck {
 public:
  /// task: as of the AnswerCheck, which checks samples proposed by eq. 3.
  FitCheck(const MatchTask& task, const DepthImages& images, std::span<const Point> points);

  /// The first wrong value as a sentence that names cell or sample; nothing when all are right.
  [[nodiscard]] Mismatch disagreement(const Answer& answer) const;

 private:
  struct Cell {
    double depth = 0;  // sum, in steps
    double points = 0;
    bool is_certain = true;
  };

  void add(const Position& point, bool is_certain);
  /// Null: beyond the image.
  [[nodiscard]] Cell* cell_at(double column, double row);
  [[nodiscard]] Mismatch wrong_cell(std::span<const float> depth_image) const;
  [[nodiscard]] Mismatch wrong_proposal(const FitAnswer& answer) const;
  [[nodiscard]] Mismatch wrong_candidate(const Answer& answer) const;

  const DepthImages& images_;
  std::size_t proposals_, candidates_;
  std::array<double, 12> T_camera_reference_{};
  double position_error_, depth_error_ = 0;  // bounds of rounding errors, length unit
  double uncertain_points_ = 0;
  std::vector<Cell> cells_;
};

/// The whole check of a frame, for the answers of all methods.
class FrameCheck {
 public:
  FrameCheck(const MatchTask& task, std::span<const Point> points);
  [[nodiscard]] Mismatch disagreement(const Answer& answer);

 private:
  AnswerCheck answer_;
  std::optional<FitCheck> fit_;
};

/// By `config`.
[[nodiscard]] MatchTask task_of(const Model& model, const MatcherConfig& config);

}  // namespace lbea::tool::bench
