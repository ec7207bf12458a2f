// A cloud in reference coordinates, in double precision, sorted into what the ensemble's envelope holds and what not.
#pragma once

#include "runtime/src/model/model_view.hpp"

#include <lbea/lbea.hpp>

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace lbea::tool::bench {

inline constexpr double float_rounding = 0x1p-24;  // u: largest relative error of one rounding to float

using Position = std::array<double, 3>;

enum class Membership : std::uint8_t { inside, boundary, outside };  // boundary: rounding decides

struct PlainCloud {
  PlainCloud(std::span<const Point> points, const RigidTransform& T_reference_sensor, const EnvelopeView& envelope);

  std::vector<Position> positions;
  std::vector<Membership> membership;  // points that are not finite are outside
  double position_error = 0;           // bound per coordinate on what rounding does to a transformed point
};

/// Distance from every vertex to the nearest point inside the envelope; infinity when there is none.
[[nodiscard]] std::vector<double> nearest_distances(const PlainCloud& cloud,
                                                    std::span<const std::array<float, 3>> vertices);

[[nodiscard]] double distance(const Position& a, const Position& b) noexcept;

}  // namespace lbea::tool::bench
