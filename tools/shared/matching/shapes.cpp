#include "tools/shared/matching/shapes.hpp"

#include "runtime/src/model/eroded_elements.hpp"

#include <lbea/inference.hpp>

#include <algorithm>
#include <cmath>

namespace lbea::tool {
namespace {

constexpr float largest_share = 100;

Shape alone(Sample sample) { return {{sample, 1.0f}}; }

}  // namespace

bool is_shape_of(const Model& model, const Shape& shape) noexcept {
  const auto is_share = [&](const WeightedSample& share) {
    return model.sample_index(share.sample) < model.samples() && std::abs(share.weight) <= largest_share;
  };
  return !shape.empty() && shape.size() <= most_samples_of_shape && std::ranges::all_of(shape, is_share);
}

std::vector<float> positions_of(const Model& model, const Shape& shape) {
  Inferred inferred;
  infer_positions(model, shape, {}, inferred);
  return std::move(inferred.mean);
}

std::vector<float> field_of(const Model& model, const Shape& shape, std::uint32_t field) {
  Inferred inferred;
  infer_field(model, field, shape, {}, inferred);
  return std::move(inferred.mean);
}

double time_of(const Model& model, const Shape& shape) noexcept {
  double time_s = 0;
  for (const WeightedSample& share : shape)
    time_s += static_cast<double>(share.weight) * model.sample_time_s(model.sample_index(share.sample));
  return time_s;
}

Leaders leaders_of(const wire::WireResult& result) {
  std::vector<Sample> ranked;
  for (const wire::WireMatch& match : result.matches) ranked.push_back(match.sample);
  for (const Match& candidate : result.fit.candidates) ranked.push_back(candidate.sample);
  Leaders leaders;
  if (ranked.empty()) return leaders;
  leaders.match = alone(ranked.front());
  leaders.estimate =
      result.fit.estimate.empty() ? leaders.match : Shape(result.fit.estimate.begin(), result.fit.estimate.end());
  const auto other = std::ranges::find_if(
      ranked, [&](const Sample& sample) { return sample.simulation != ranked.front().simulation; });
  if (other != ranked.end()) leaders.ghost = alone(*other);
  return leaders;
}

std::vector<float> final_positions_of(const Model& model, const wire::WireForecast& forecast) {
  std::vector<float> weights(model.simulations(), 0.0f);
  for (const wire::RunWeight& run : forecast.runs) {
    if (run.simulation >= weights.size() || !(std::abs(run.weight) <= largest_share)) return {};
    weights[run.simulation] = run.weight;
  }
  if (forecast.frames == 0 || forecast.runs.empty()) return {};
  TestForecast test;
  test.run_weights = weights;
  return final_positions(model, test);
}

std::vector<std::uint8_t> present_in(const Model& model, const Shape& shape) {
  if (model.view().eroded.empty()) return {};
  float all = 0;
  std::vector<float> weights(model.elements());
  for (const auto& [sample, weight] : shape) {
    const std::vector<std::uint8_t> present = present_elements(model, model.sample_index(sample));
    all += std::abs(weight);
    for (std::size_t e = 0; e < weights.size(); ++e) weights[e] += present[e] != 0 ? std::abs(weight) : 0;
  }
  std::vector<std::uint8_t> present(weights.size());
  std::ranges::transform(weights, present.begin(), [&](float weight) { return weight > all / 2 ? 1 : 0; });
  return present;
}

std::vector<std::uint32_t> eroded_in(const Model& model, const Shape& shape) {
  const std::vector<std::uint8_t> present = present_in(model, shape);
  std::vector<std::uint32_t> eroded;
  for (std::uint32_t e = 0; e < present.size(); ++e)
    if (present[e] == 0) eroded.push_back(e);
  return eroded;
}

std::vector<std::array<std::uint32_t, 4>> elements_of(const Model& model) {
  const auto corners = model.element_nodes();
  std::vector<std::array<std::uint32_t, 4>> elements;
  elements.reserve(model.elements());
  for (std::size_t e = 0; e < model.elements(); ++e)
    elements.push_back({corners[4 * e], corners[4 * e + 1], corners[4 * e + 2], corners[4 * e + 3]});
  return elements;
}

std::vector<std::array<std::uint32_t, 4>> without_eroded(std::vector<std::array<std::uint32_t, 4>> elements,
                                                         std::span<const std::uint32_t> eroded) {
  for (const std::uint32_t e : eroded) elements[e].fill(elements[e][0]);
  return elements;
}

}  // namespace lbea::tool
