// What a pipeline found in one frame, and whether that is right.
#pragma once

#include "runtime/src/match/sample_search.hpp"
#include "runtime/src/model/model_view.hpp"
#include "tools/bench/plain_cloud.hpp"

#include <lbea/lbea.hpp>

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace lbea::tool::bench {

struct Answer {
  std::uint32_t reference = 0;
  std::vector<std::uint32_t> points;  // per vertex of the reference: place in the frame of the nearest point
  std::vector<float> coefficients;    // modes x 3, mode-major
  std::vector<RankedSample> ranked;   // nearest first
};

struct Question {
  const ModelView& model;
  Method method = Method::lbea;
  RigidTransform T_reference_sensor = identity_transform;
  std::size_t matches = 1;  // how many samples to rank
};

/// Holds answers to one frame against a plain computation in double precision: the nearest point of every vertex by
/// looking at every point, the projection, and eq. 3 or eq. 1 over every sample. Differences that rounding to float can
/// explain, by bounds on its error, are none; so are points that lie on the envelope's boundary.
class Judge {
 public:
  Judge(const Question& question, std::span<const Point> points);

  /// The first disagreement as a sentence that names vertex, coefficient or sample; nothing when all agrees.
  [[nodiscard]] std::optional<std::string> disagreement(const Answer& answer);

 private:
  [[nodiscard]] std::optional<std::string> wrong_nearest(const Answer& answer);
  [[nodiscard]] const std::vector<double>& least_distances(std::uint32_t reference);

  Question question_;
  PlainCloud cloud_;
  std::vector<std::vector<double>> least_;  // per reference and vertex, once asked for: to the nearest point
};

}  // namespace lbea::tool::bench
