#include "adapters/simulation/keyword/transform.hpp"

#include <cmath>
#include <numbers>

namespace lbea::io::keyword {
namespace {
constexpr std::size_t fields_per_card = 8;

/// The fields of a card of eight equal columns.
std::vector<std::string_view> fields(const Cards& cards, std::string_view line) {
  const std::size_t width = cards.column_width();
  auto all = Cards::split(line, fields_per_card, 0, {width, width});
  all.resize(std::max(all.size(), fields_per_card));
  return all;
}

std::vector<std::string_view> next_fields(Cards& cards) {
  std::string_view line;
  return fields(cards, cards.next(line) ? line : std::string_view());
}

Motion scaled(double x, double y, double z) { return {{{{x, 0, 0}, {0, y, 0}, {0, 0, z}}}, {}}; }

Motion scale_of(const std::array<double, 7>& a) {  // a blank factor is 1
  return scaled(a[0] == 0 ? 1 : a[0], a[1] == 0 ? 1 : a[1], a[2] == 0 ? 1 : a[2]);
}

/// Rodrigues' formula, around an axis through `point`.
Motion rotation(std::array<double, 3> axis, const std::array<double, 3>& point, double degrees) {
  const double length = std::hypot(axis[0], axis[1], axis[2]), angle = degrees * std::numbers::pi / 180;
  for (double& component : axis) component /= length;
  const double c = std::cos(angle), s = std::sin(angle);
  const std::array<std::array<double, 3>, 3> cross{
      {{0, -axis[2], axis[1]}, {axis[2], 0, -axis[0]}, {-axis[1], axis[0], 0}}};
  Motion result;
  for (std::size_t i = 0; i < 3; ++i)
    for (std::size_t j = 0; j < 3; ++j)
      result.matrix[i][j] = (i == j ? c : 0) + s * cross[i][j] + (1 - c) * axis[i] * axis[j];
  const auto moved = result(point);
  for (std::size_t i = 0; i < 3; ++i) result.shift[i] = point[i] - moved[i];
  return result;
}

Motion rotation_of(const Cards& cards, const std::array<double, 7>& a) {
  if (a[3] == 0 && a[4] == 0 && a[5] == 0 && a[6] == 0)
    cards.fail("this ROTATE is given by nodes, which is not read; write direction, point and angle",
               Status::unsupported_input);
  if (a[0] == 0 && a[1] == 0 && a[2] == 0) cards.fail("ROTATE has no direction");
  return rotation({a[0], a[1], a[2]}, {a[3], a[4], a[5]}, a[6]);
}

Motion option_of(const Cards& cards, const std::vector<std::string_view>& card) {
  std::array<double, 7> a{};
  const std::string option = in_capitals(card[0]);
  if (option != "TRANSL" && option != "SCALE" && option != "ROTATE")
    cards.fail(
        "the option " + text::quoted(card[0]) + " of *DEFINE_TRANSFORMATION is not read; use TRANSL, SCALE or ROTATE",
        Status::unsupported_input);
  for (std::size_t i = 0; i < a.size(); ++i) a[i] = static_cast<double>(cards.number(card[i + 1]));
  if (option == "ROTATE") return rotation_of(cards, a);
  return option == "SCALE" ? scale_of(a) : Motion{Motion().matrix, {a[0], a[1], a[2]}};
}

std::int64_t offset(const Cards& cards, std::string_view field) {
  std::int64_t value = 0;
  if (!field.empty() && !text::parse_integer(field, value))
    cards.fail(text::quoted(field) + " is not an offset of ids");
  if (std::abs(value) > 0xffffffff) cards.fail("the offset of ids " + text::quoted(field) + " is too large");
  return value;
}

const Motion& motion_called(const Cards& cards, const Motions& motions, std::int64_t id) {
  const auto found = motions.find(id);
  if (found == motions.end())
    cards.fail("*DEFINE_TRANSFORMATION " + std::to_string(id) + " is not defined before it is used here");
  return found->second;
}
}  // namespace

std::array<double, 3> Motion::operator()(const std::array<double, 3>& x) const noexcept {
  std::array<double, 3> y = shift;
  for (std::size_t i = 0; i < 3; ++i) y[i] += matrix[i][0] * x[0] + matrix[i][1] * x[1] + matrix[i][2] * x[2];
  return y;
}

Motion composed(const Motion& outer, const Motion& inner) noexcept {
  Motion both;
  both.shift = outer(inner.shift);
  for (std::size_t i = 0; i < 3; ++i)
    for (std::size_t j = 0; j < 3; ++j)
      both.matrix[i][j] = outer.matrix[i][0] * inner.matrix[0][j] + outer.matrix[i][1] * inner.matrix[1][j] +
                          outer.matrix[i][2] * inner.matrix[2][j];
  return both;
}

Transform Transform::of_included(const Transform& inner) const noexcept {
  return {node_offset + inner.node_offset, element_offset + inner.element_offset, part_offset + inner.part_offset,
          definition_offset + inner.definition_offset, composed(motion, inner.motion)};
}

void read_motion(Cards& cards, bool has_title, std::int64_t id_offset, Motions& into) {
  std::string_view line;
  if (has_title) cards.next(line);
  const std::int64_t id = cards.id(next_fields(cards)[0]) + id_offset;
  Motion motion;
  while (cards.next(line))
    if (!text::trimmed(line).empty()) motion = composed(option_of(cards, fields(cards, line)), motion);
  if (into.emplace(id, motion).first->second != motion)
    cards.fail("*DEFINE_TRANSFORMATION " + std::to_string(id) +
               " is defined twice; give each one its own id, or an offset IDDOFF to the included file");
}

Transform read_transform(Cards& cards, std::int64_t id_offset, const Motions& motions) {
  Transform transform;
  const auto offsets = next_fields(cards);
  transform.node_offset = offset(cards, offsets[0]);
  transform.element_offset = offset(cards, offsets[1]);
  transform.part_offset = offset(cards, offsets[2]);
  transform.definition_offset = offset(cards, offsets[6]);  // IDDOFF
  next_fields(cards);                                       // of other ids, prefix and suffix of names
  const double length = static_cast<double>(cards.number(next_fields(cards)[2]));  // FCTLEN
  if (length != 0) transform.motion = scaled(length, length, length);
  const auto motion = next_fields(cards)[0];
  if (motion.empty() || cards.id(motion) == 0) return transform;
  if (transform.motion != Motion())
    cards.fail("FCTLEN and TRANID together are not read; put the SCALE into *DEFINE_TRANSFORMATION",
               Status::unsupported_input);
  transform.motion = motion_called(cards, motions, cards.id(motion) + id_offset);
  return transform;
}
}  // namespace lbea::io::keyword
