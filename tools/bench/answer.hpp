// The result of a pipeline for one frame, and its check against a computation in double precision.
#pragma once

#include "runtime/src/match/sample_search.hpp"
#include "runtime/src/model/model_view.hpp"

#include <lbea/lbea.hpp>

#include <optional>

namespace lbea::tool::bench {

inline constexpr double float_rounding = 0x1p-24;  // u: largest relative error of rounding to float

using Position = std::array<double, 3>;
using Mismatch = std::optional<std::string>;  // the first wrong value as a sentence; nothing: all are right

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

/// What method fit adds to the proposed samples.
struct FitAnswer {
  std::vector<float> depth_image;        // cells: in depth steps, nothing_seen
  std::vector<RankedSample> proposed{};  // by their thinned images; empty: Answer::ranked, by eq. 3
  std::vector<RankedSample> candidates;  // of the proposed samples; distance: residual, length unit
  bool is_hidden = false;                // something hides a part of the frame
};

struct Answer {
  std::uint32_t reference = 0;
  std::vector<std::uint32_t> points;  // per vertex of the reference: index of the nearest point of the frame
  std::uint32_t cut = 0;              // number of vertices whose point may not be the nearest one
  std::vector<float> coefficients;    // modes x 3, mode-major
  std::vector<RankedSample> ranked;   // nearest first; by method fit the proposed samples
  std::optional<FitAnswer> fit{};
};

/// What a pipeline computes.
struct MatchTask {
  const ModelView& model;
  Method method = Method::lbea;
  RigidTransform T_reference_sensor = identity_transform;
  std::size_t matches = 1;     // number of samples to rank
  std::size_t proposals = 0;   // by method fit: of samples whose depth images are compared
  std::size_t candidates = 0;  // and of the best of these
};

/// A bound of the rounding error of distances.
struct Tolerance {
  double absolute, relative;
  double missed = 0;  // how much nearer a sample may be that was not found, as a share; 0: the search is exact
  [[nodiscard]] double of(double distance) const { return absolute + relative * distance; }
};

/// The first wrong place of a ranking of `matches` samples by `distances`, as a sentence. Distances may be infinite.
[[nodiscard]] Mismatch wrong_ranking(std::span<const RankedSample> ranked, std::span<const double> distances,
                                     std::size_t matches, Tolerance tolerance);

/// Checks the answers for one frame by a computation in double precision without indices: the nearest of all points for
/// every vertex, the projection, and eq. 3 or eq. 1 over every sample. Differences within the error bounds of rounding
/// to float are accepted, and so are points on the boundary of the envelope.
class AnswerCheck {
 public:
  AnswerCheck(const MatchTask& task, std::span<const Point> points);

  /// The first wrong value as a sentence that names vertex, coefficient or sample; nothing when all are right.
  [[nodiscard]] Mismatch disagreement(const Answer& answer);

 private:
  [[nodiscard]] Mismatch wrong_nearest(const Answer& answer);
  [[nodiscard]] const std::vector<double>& least_distances(std::uint32_t reference);

  MatchTask task_;
  ReferenceCloud cloud_;
  std::vector<std::vector<double>>
      least_;  // per reference and vertex: distance to the nearest point, computed on first use
};

}  // namespace lbea::tool::bench
