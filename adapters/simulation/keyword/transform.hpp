// *INCLUDE_TRANSFORM: what it does to the ids and nodes of the included file.
#pragma once

#include "adapters/simulation/keyword/cards.hpp"

#include <array>
#include <map>

namespace lbea::io::keyword {
/// x -> matrix x + shift.
struct Motion {
  std::array<std::array<double, 3>, 3> matrix{{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}};
  std::array<double, 3> shift{};

  [[nodiscard]] std::array<double, 3> operator()(const std::array<double, 3>& x) const noexcept;
  [[nodiscard]] bool operator==(const Motion&) const noexcept = default;
};

/// First `inner`, then `outer`.
[[nodiscard]] Motion composed(const Motion& outer, const Motion& inner) noexcept;

struct Transform {
  std::int64_t node_offset = 0, element_offset = 0, part_offset = 0, definition_offset = 0;
  Motion motion;

  /// What a file included with `inner` gets when the including file itself has this transform.
  [[nodiscard]] Transform of_included(const Transform& inner) const noexcept;
};

/// *DEFINE_TRANSFORMATION by id, with the offset of the file.
using Motions = std::map<std::int64_t, Motion>;

/// Reads the cards of *DEFINE_TRANSFORMATION: TRANSL, SCALE and ROTATE by direction, point and angle, applied in their
/// order. Throws Error{bad_input | unsupported_input} for other options, and when the id has another motion already.
void read_motion(Cards& cards, bool has_title, std::int64_t id_offset, Motions& into);

/// Reads the cards of *INCLUDE_TRANSFORM after the name of the file: offsets of ids, FCTLEN, TRANID. Other offsets and
/// factors concern no mesh. Throws Error{bad_input | unsupported_input}.
[[nodiscard]] Transform read_transform(Cards& cards, std::int64_t id_offset, const Motions& motions);
}  // namespace lbea::io::keyword
