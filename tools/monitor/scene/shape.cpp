#include "tools/monitor/scene/shape.hpp"

#include <algorithm>
#include <charconv>
#include <cmath>

namespace lbea::tool {
namespace {

constexpr std::size_t most_samples = 256;

template <class Values>
std::vector<float> blend(const Model& model, const Shape& shape, std::size_t count, Values values_of) {
  std::vector<float> sum(count, 0.0f);
  for (const WeightedSample& share : shape) {
    const auto& values = values_of(model.sample_index(share.sample));
    for (std::size_t i = 0; i < count; ++i) sum[i] += share.weight * values[i];
  }
  return sum;
}

template <class Number>
bool take(std::string_view& text, Number& into, char after) {
  const auto [stop, error] = std::from_chars(text.data(), text.data() + text.size(), into);
  if (error != std::errc{}) return false;
  text.remove_prefix(static_cast<std::size_t>(stop - text.data()));
  if (text.empty()) return after == ',';
  if (text.front() != after) return false;
  text.remove_prefix(1);
  return true;
}

}  // namespace

bool is_shape_of(const Model& model, const Shape& shape) noexcept {
  const auto is_share = [&](const WeightedSample& share) {
    return model.sample_index(share.sample) < model.samples() && share.weight > 0 && share.weight <= 1;
  };
  return !shape.empty() && shape.size() <= most_samples && std::ranges::all_of(shape, is_share);
}

std::vector<float> positions_of(const Model& model, const Shape& shape) {
  return blend(model, shape, std::size_t{model.nodes()} * 3,
               [&](std::uint32_t sample) { return model.node_positions(sample); });
}

std::vector<float> field_of(const Model& model, const Shape& shape, std::uint32_t field) {
  std::vector<float> values(model.field_size(field));
  return blend(model, shape, values.size(), [&](std::uint32_t sample) {
    model.read_field(field, sample, values);
    return std::span<const float>(values);
  });
}

double time_of(const Model& model, const Shape& shape) noexcept {
  double time_s = 0;
  for (const WeightedSample& share : shape)
    time_s += static_cast<double>(share.weight) * model.sample_time_s(model.sample_index(share.sample));
  return time_s;
}

std::optional<Shape> parse_shape(std::string_view text) {
  Shape shape;
  while (!text.empty() && shape.size() < most_samples) {
    WeightedSample share;
    if (!take(text, share.sample.simulation, ':') || !take(text, share.sample.time_step, ':') ||
        !take(text, share.weight, ','))
      return {};
    if (!std::isfinite(share.weight)) return {};
    shape.push_back(share);
  }
  if (!text.empty() || shape.empty()) return {};
  return shape;
}

}  // namespace lbea::tool
