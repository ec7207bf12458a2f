#include "tools/monitor/scene/scene.hpp"

#include "tools/monitor/scene/packet.hpp"
#include "tools/shared/answer/doubtful.hpp"

#include <lbea/inference.hpp>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <charconv>
#include <cmath>

namespace lbea::tool {
namespace {

constexpr std::uint32_t most_fields = 8;
constexpr float margin = 0.3f;  // of the size of the component; points farther from it are not shown
constexpr double distance_limit_mm = 10;
constexpr float full_scale = 65535.0f;
constexpr double infinity = std::numeric_limits<double>::infinity();

nlohmann::json to_json(const Shape& shape) {
  nlohmann::json shares = nlohmann::json::array();
  for (const WeightedSample& share : shape)
    shares.push_back({share.sample.simulation, share.sample.time_step, share.weight});
  return shares;
}

std::uint16_t quantized(float share) {
  return static_cast<std::uint16_t>(std::lround(std::clamp(share, 0.0f, 1.0f) * full_scale));
}

nlohmann::json to_json(const wire::WireTestState& test) {
  nlohmann::json simulations = nlohmann::json::array();
  for (const wire::SimulationChance& chance : test.simulations)
    simulations.push_back({chance.simulation, chance.probability});
  return {{"frames", test.frames},
          {"simulation", test.simulation},
          {"sample", {test.sample.simulation, test.sample.time_step}},
          {"sample_probability", test.sample_probability},
          {"simulations", simulations},
          {"branches", test.branches}};
}

nlohmann::json to_json(const wire::WireFit& fit) {
  nlohmann::json candidates = nlohmann::json::array();
  for (const Match& candidate : fit.candidates)
    candidates.push_back({candidate.sample.simulation, candidate.sample.time_step, candidate.distance});
  nlohmann::json json{{"candidates", candidates}, {"estimate", to_json(fit.estimate)}};
  for (const auto& number : fit_numbers) json[number.name] = fit.*number.value;
  return json;
}

nlohmann::json to_json(const wire::WireForecast& forecast) {
  nlohmann::json parameters = nlohmann::json::array();
  for (const ParameterForecast& parameter : forecast.parameters)
    parameters.push_back({{"value", parameter.value},
                          {"bound_90", parameter.bound_90},
                          {"r2", parameter.r2},
                          {"identifiable", parameter.is_identifiable()}});
  return {{"frames", forecast.frames},
          {"error_90", forecast.error_90},
          {"branches", forecast.branches},
          {"parameters", parameters}};
}

template <class Number>
bool parse_number(std::string_view& text, Number& into, char after) {
  const auto [stop, error] = std::from_chars(text.data(), text.data() + text.size(), into);
  if (error != std::errc{}) return false;
  text.remove_prefix(static_cast<std::size_t>(stop - text.data()));
  if (text.empty()) return after == ',';
  if (text.front() != after) return false;
  text.remove_prefix(1);
  return true;
}

}  // namespace

std::optional<Shape> parse_shape(std::string_view text) {
  Shape shape;
  while (!text.empty() && shape.size() < most_samples_of_shape) {
    WeightedSample share;
    if (!parse_number(text, share.sample.simulation, ':') || !parse_number(text, share.sample.time_step, ':') ||
        !parse_number(text, share.weight, ','))
      return {};
    if (!std::isfinite(share.weight)) return {};
    shape.push_back(share);
  }
  if (!text.empty() || shape.empty()) return {};
  return shape;
}

nlohmann::json to_json(const wire::WireResult& result) {
  nlohmann::json matches = nlohmann::json::array();
  for (const wire::WireMatch& match : result.matches)
    matches.push_back({{"simulation", match.sample.simulation},
                       {"name", match.simulation_name},
                       {"time_step", match.sample.time_step},
                       {"time_s", match.time_s},
                       {"distance", match.distance}});
  nlohmann::json json{{"frame", result.frame_id},
                      {"session", std::to_string(result.session)},
                      {"stamp_ns", std::to_string(result.stamp_ns)},
                      {"status", wire::to_string(result.status)},
                      {"verdict", wire::to_string(result.verdict)},
                      {"points", result.points.received},
                      {"used", result.points.used},
                      {"matches", matches},
                      {"reference", result.reference},
                      {"xyz", result.leading_coordinates}};
  for (const auto& number : frame_numbers) json[number.name] = result.*number.value;
  if (!result.fit.candidates.empty()) json["fit"] = to_json(result.fit);
  if (result.test.frames > 0) json["test"] = to_json(result.test);
  if (result.forecast.frames > 0) json["forecast"] = to_json(result.forecast);
  for (const wire::WireChannel& channel : result.channels)
    json["channels"].push_back({{"name", channel.name},
                                {"value", channel.value},
                                {"bound_90", channel.bound_90},
                                {"end_value", channel.end.value},
                                {"end_bound_90", channel.end.bound_90}});
  json["doubtful"] = is_doubtful(result);
  return json;
}

nlohmann::json json_of(const SceneBox& box) {
  return {{"lo", box.lo}, {"hi", box.hi}, {"distance_limit", box.distance_limit}};
}

SceneBuilder::SceneBuilder(const Model& model, const ModelRanges& ranges)
    : model_(model),
      box_{ranges.lo, ranges.hi, distance_limit_mm * units_per_mm(model.length_unit())},
      elements_(elements_of(model)) {
  const float size = std::max({box_.hi[0] - box_.lo[0], box_.hi[1] - box_.lo[1], box_.hi[2] - box_.lo[2], 1e-6f});
  for (std::size_t k = 0; k < 3; ++k) {
    box_.lo[k] -= margin * size;
    box_.hi[k] += margin * size;
  }
}

nlohmann::json SceneBuilder::add_meshes(const wire::WireResult& result, Packet& packet,
                                        std::optional<bake::SurfaceTree>& surface) const {
  const Leaders leaders = leaders_of(result);
  nlohmann::json shown = nlohmann::json::object();
  const auto add = [&](const char* name, const Shape& shape) {
    std::vector<float> positions;
    if (!is_shape_of(model_, shape)) return positions;
    positions = positions_of(model_, shape);
    packet.add(name, positions);
    if (const auto eroded = eroded_in(model_, shape); !eroded.empty())
      packet.add(std::string(name) + "_eroded", eroded);
    shown[name] = {{"shape", to_json(shape)}, {"time_s", time_of(model_, shape)}};
    return positions;
  };
  if (const auto positions = add("estimate", leaders.estimate); !positions.empty())
    surface.emplace(positions, without_eroded(elements_, eroded_in(model_, leaders.estimate)));
  add("match", leaders.match);
  add("ghost", leaders.ghost);
  if (const auto end = final_positions_of(model_, result.forecast); !end.empty()) packet.add("final", end);
  const std::uint32_t fields = std::min(most_fields, model_.fields());
  for (std::uint32_t field = 0; field < fields; ++field) {
    const std::string number = std::to_string(field);
    if (is_shape_of(model_, leaders.estimate)) packet.add("field" + number, field_of(model_, leaders.estimate, field));
    if (is_shape_of(model_, leaders.match)) packet.add("match_field" + number, field_of(model_, leaders.match, field));
  }
  return shown;
}

static std::array<double, 3> position_of(const Point& point) {
  return {double{point.x}, double{point.y}, double{point.z}};
}

// nearest() gives infinity beyond the limit.
static double distance_from(std::span<const std::optional<bake::SurfaceTree>> surfaces, const Point& point,
                            double limit) {
  double least = infinity;
  for (const std::optional<bake::SurfaceTree>& surface : surfaces)
    if (surface) least = std::min(least, surface->nearest(position_of(point), std::min(limit, least)).distance);
  return least;
}

nlohmann::json add_cloud(const std::vector<Point>& points, const SceneBox& box,
                         std::span<const std::optional<bake::SurfaceTree>> surfaces, Packet& packet) {
  std::vector<std::uint16_t> values;
  values.reserve(points.size() * 4);
  for (const Point& point : points) {
    const std::array<float, 3> at{point.x, point.y, point.z};
    std::array<float, 3> share{};
    for (std::size_t k = 0; k < 3; ++k) share[k] = (at[k] - box.lo[k]) / (box.hi[k] - box.lo[k]);
    if (!std::ranges::all_of(share, [](float s) { return s >= 0 && s <= 1; })) continue;
    const double distance = distance_from(surfaces, point, box.distance_limit);
    values.insert(values.end(), {quantized(share[0]), quantized(share[1]), quantized(share[2]),
                                 quantized(static_cast<float>(distance / box.distance_limit))});
  }
  const std::size_t shown = values.size() / 4;
  packet.add("cloud", std::move(values));
  return {{"points", shown}, {"elsewhere", points.size() - shown}};
}

nlohmann::json SceneBuilder::scene_of(const wire::WireResult& result, Packet& packet,
                                      std::optional<bake::SurfaceTree>& surface) const {
  nlohmann::json scene = json_of(box_);
  scene["frame"] = result.frame_id;
  const bool of_this_model = result.model_checksum == model_.checksum();
  scene["meshes"] = of_this_model ? add_meshes(result, packet, surface) : nlohmann::json::object();
  return scene;
}

std::string SceneBuilder::build(const Moment& moment, nlohmann::json head) const {
  Packet packet;
  std::optional<bake::SurfaceTree> surface;
  nlohmann::json scene = scene_of(moment.result, packet, surface);
  if (moment.cloud != nullptr) scene["cloud"] = add_cloud(*moment.cloud, box_, std::span(&surface, 1), packet);
  head["scene"] = std::move(scene);
  return packet.finish(std::move(head));
}

std::string SceneBuilder::build_meshes(const wire::WireResult& result, nlohmann::json head,
                                       std::optional<bake::SurfaceTree>& surface) const {
  Packet packet;
  head["scene"] = scene_of(result, packet, surface);
  return packet.finish(std::move(head));
}

}  // namespace lbea::tool
