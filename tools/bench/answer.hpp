// The result of a pipeline for one frame, and its check against a computation in double precision.
#pragma once

#include "runtime/src/match/sample_search.hpp"
#include "runtime/src/model/model_view.hpp"

#include <lbea/lbea.hpp>

#include <optional>

namespace lbea::tool::bench {

inline constexpr double float_rounding = 0x1p-24;  // u: largest relative error of rounding to float

using Position = std::array<double, 3>;

enum class Membership : std::uint8_t { inside, boundary, outside };  // boundary: depends on rounding

/// A cloud in reference coordinates, in double precision. Its points are classified by the envelope of the ensemble.
struct ReferenceCloud {
  ReferenceCloud(std::span<const Point> points, const RigidTransform& T_reference_sensor, const EnvelopeView& envelope);

  std::vector<Position> positions;
  std::vector<Membership> membership;  // points that are not finite are outside
  double position_error = 0;           // bound per coordinate on the rounding error of a transformed point
};

/// Distance from every vertex to the nearest point inside the envelope; infinity when there is none.
[[nodiscard]] std::vector<double> nearest_distances(const ReferenceCloud& cloud,
                                                    std::span<const std::array<float, 3>> vertices);

[[nodiscard]] double distance(const Position& a, const Position& b) noexcept;

struct Answer {
  std::uint32_t reference = 0;
  std::vector<std::uint32_t> points;  // per vertex of the reference: index of the nearest point of the frame
  std::uint32_t cut = 0;              // number of vertices whose point may not be the nearest one
  std::vector<float> coefficients;    // modes x 3, mode-major
  std::vector<RankedSample> ranked;   // nearest first
};

/// What a pipeline computes.
struct MatchTask {
  const ModelView& model;
  Method method = Method::lbea;
  RigidTransform T_reference_sensor = identity_transform;
  std::size_t matches = 1;  // number of samples to rank
};

/// Checks the answers for one frame by a computation in double precision without indices: the nearest of all points for
/// every vertex, the projection, and eq. 3 or eq. 1 over every sample. Differences within the error bounds of rounding
/// to float are accepted, and so are points on the boundary of the envelope.
class AnswerCheck {
 public:
  AnswerCheck(const MatchTask& task, std::span<const Point> points);

  /// The first wrong value as a sentence that names vertex, coefficient or sample; nothing when all are right.
  [[nodiscard]] std::optional<std::string> disagreement(const Answer& answer);

 private:
  [[nodiscard]] std::optional<std::string> wrong_nearest(const Answer& answer);
  [[nodiscard]] const std::vector<double>& least_distances(std::uint32_t reference);

  MatchTask task_;
  ReferenceCloud cloud_;
  std::vector<std::vector<double>>
      least_;  // per reference and vertex: distance to the nearest point, computed on first use
};

}  // namespace lbea::tool::bench
