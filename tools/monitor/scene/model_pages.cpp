#include "tools/monitor/scene/model_pages.hpp"

#include "tools/monitor/scene/packet.hpp"

#include <nlohmann/json.hpp>

#include <algorithm>
#include <cmath>
#include <limits>

namespace lbea::tool {
namespace {

constexpr std::uint32_t most_ranged_samples = 400;
constexpr std::size_t most_range_values = 1'000'000;  // per field
constexpr std::uint32_t most_curve_points = 20'000;

template <class Visit>
void for_picked_samples(const Model& model, std::uint32_t most, Visit visit) {
  const std::uint32_t picked = std::min(most, model.samples());
  for (std::uint32_t i = 0; i < picked; ++i)
    visit(static_cast<std::uint32_t>(std::uint64_t{i} * model.samples() / picked));
}

/// From the least to where one value in a hundred lies above: a few folded elements must not take all colours.
FieldRange range_of(std::vector<float>& values) {
  if (values.empty()) return {};
  const float least = *std::ranges::min_element(values), most = *std::ranges::max_element(values);
  const auto high = values.begin() + static_cast<std::ptrdiff_t>((values.size() - 1) * 99 / 100);
  std::ranges::nth_element(values, high);
  return {least, *high > least ? *high : most};
}

void append_some(std::vector<float>& values, std::span<const float> more, std::size_t every) {
  for (std::size_t i = 0; i < more.size(); i += every)
    if (std::isfinite(more[i])) values.push_back(more[i]);
}

std::vector<float> curves_of(const Model& model) {
  std::vector<float> curves;
  for_picked_samples(model, most_curve_points, [&](std::uint32_t sample) {
    const auto at = model.leading_coordinates(0, sample);
    curves.insert(curves.end(), {static_cast<float>(model.sample(sample).simulation),
                                 static_cast<float>(model.sample_time_s(sample)), at[0], at[1], at[2]});
  });
  return curves;
}

nlohmann::json simulations_of(const Model& model) {
  nlohmann::json simulations = nlohmann::json::array();
  for (std::uint32_t i = 0; i < model.simulations(); ++i) {
    nlohmann::json parameters = nlohmann::json::array();
    for (std::uint32_t k = 0; k < model.parameters(); ++k)
      parameters.push_back(model.parameter(i, k));  // NaN becomes null
    simulations.push_back(
        {{"name", model.simulation_name(i)}, {"branch", model.branch_of(i)}, {"parameters", parameters}});
  }
  return simulations;
}

nlohmann::json fields_of(const Model& model, const ModelRanges& ranges) {
  nlohmann::json fields = nlohmann::json::array();
  for (std::uint32_t i = 0; i < model.fields(); ++i) {
    const FieldInfo info = model.field(i);
    fields.push_back({{"name", info.name},
                      {"unit", info.unit},
                      {"location", info.location == FieldInfo::Location::node ? "node" : "element"},
                      {"lo", ranges.fields[i].lo},
                      {"hi", ranges.fields[i].hi}});
  }
  return fields;
}

}  // namespace

ModelRanges ranges_of(const Model& model) {
  constexpr float infinity = std::numeric_limits<float>::infinity();
  ModelRanges ranges;
  ranges.lo.fill(infinity);
  ranges.hi.fill(-infinity);
  std::vector<std::vector<float>> values(model.fields());
  const std::size_t picked = std::min(most_ranged_samples, model.samples());
  for_picked_samples(model, most_ranged_samples, [&](std::uint32_t sample) {
    const auto positions = model.node_positions(sample);
    for (std::size_t i = 0; i < positions.size(); ++i) {
      ranges.lo[i % 3] = std::min(ranges.lo[i % 3], positions[i]);
      ranges.hi[i % 3] = std::max(ranges.hi[i % 3], positions[i]);
    }
    for (std::uint32_t field = 0; field < model.fields(); ++field) {
      std::vector<float> its(model.field_size(field));
      model.read_field(field, sample, its);
      append_some(values[field], its, 1 + its.size() * picked / most_range_values);
    }
  });
  for (std::vector<float>& its : values) ranges.fields.push_back(range_of(its));
  return ranges;
}

std::vector<std::string> simulation_names(const Model& model) {
  std::vector<std::string> names;
  for (std::uint32_t i = 0; i < model.simulations(); ++i) names.emplace_back(model.simulation_name(i));
  return names;
}

std::string model_packet(const Model& model, const ModelRanges& ranges, const nlohmann::json& recording) {
  nlohmann::json parameters = nlohmann::json::array();
  for (std::uint32_t i = 0; i < model.parameters(); ++i) parameters.push_back(model.parameter_name(i));
  const nlohmann::json head{{"type", "model"},
                            {"unit", model.length_unit()},
                            {"simulations", simulations_of(model)},
                            {"parameters", parameters},
                            {"fields", fields_of(model, ranges)},
                            {"lo", ranges.lo},
                            {"hi", ranges.hi},
                            {"nodes", model.nodes()},
                            {"samples", model.samples()},
                            {"axes", model.leading_axes(0)},
                            {"branches", model.branches()},
                            {"references", model.references()},
                            {"recording", recording}};
  Packet packet;
  const auto elements = model.element_nodes();
  packet.add("elements", std::vector<std::uint32_t>(elements.begin(), elements.end()));
  packet.add("curves", curves_of(model));
  return packet.finish(head);
}

}  // namespace lbea::tool
