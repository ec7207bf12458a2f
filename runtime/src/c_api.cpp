// The C interface: thin, no thought of its own.
#include "runtime/src/c_guard.hpp"
#include "runtime/src/c_struct.hpp"

#include <lbea/lbea.h>
#include <lbea/lbea.hpp>

#include <algorithm>
#include <cstddef>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

struct lbea_model {
  explicit lbea_model(lbea::Model m) : model(std::move(m)), length_unit(model.length_unit()) {
    for (std::uint32_t s = 0; s < model.simulations(); ++s) simulation_names.emplace_back(model.simulation_name(s));
    for (std::uint32_t f = 0; f < model.fields(); ++f)
      fields.emplace_back(std::string(model.field(f).name), std::string(model.field(f).unit));
  }
  lbea::Model model;
  // Text as C reads it; the file's has no zero byte at its end.
  std::string length_unit;
  std::vector<std::string> simulation_names;
  std::vector<std::pair<std::string, std::string>> fields;
};

struct lbea_matcher {
  lbea_matcher(const lbea::Model& model, const lbea::MatcherConfig& config)
      : matcher(model, config), matches(std::min(config.max_matches, model.samples())) {}
  lbea::Matcher matcher;
  std::vector<lbea_match> matches;
};

namespace lbea {

namespace {

static_assert(sizeof(lbea_status) == 4 && sizeof(lbea_method) == 4, "enums are four bytes wide");
static_assert(sizeof(lbea_point) == sizeof(Point) && alignof(lbea_point) == alignof(Point));
static_assert(LBEA_METHOD_LBEA == static_cast<int>(Method::lbea) && LBEA_METHOD_VTP == static_cast<int>(Method::vtp));

// The structs' sizes in the first version that had them: what every caller knows.
constexpr std::size_t least_config = offsetof(lbea_config, T_reference_sensor) + sizeof(RigidTransform);
constexpr std::size_t least_frame = offsetof(lbea_frame, point_count) + sizeof(std::size_t);
constexpr std::size_t least_result = offsetof(lbea_result, coverage_ns) + sizeof(std::uint32_t);
constexpr std::size_t least_model_info = offsetof(lbea_model_info, length_unit) + sizeof(char*);
constexpr std::size_t least_field_info = offsetof(lbea_field_info, unit) + sizeof(char*);

lbea_status bad_argument(std::string_view sentence) noexcept { return failed(LBEA_BAD_ARGUMENT, sentence); }

constexpr auto size_not_set = "struct_size is not the size of the struct; set it to sizeof, or call the init function";

lbea_config to_c(const MatcherConfig& config) noexcept {
  lbea_config c{};
  c.max_points = config.max_points;
  c.max_matches = config.max_matches;
  c.method = static_cast<std::int32_t>(config.method);
  c.trusted_distance = config.trusted_distance;
  c.min_coverage = config.min_coverage;
  c.trigger_ns = config.trigger_ns;
  std::ranges::copy(config.T_reference_sensor, c.T_reference_sensor);
  return c;
}

MatcherConfig from_c(const lbea_config& c) noexcept {
  MatcherConfig config;
  config.max_points = c.max_points;
  config.max_matches = c.max_matches;
  config.method = static_cast<Method>(c.method);
  config.trusted_distance = c.trusted_distance;
  config.min_coverage = c.min_coverage;
  config.trigger_ns = c.trigger_ns;
  std::ranges::copy(c.T_reference_sensor, config.T_reference_sensor.begin());
  return config;
}

lbea_match to_c(const Match& match, const Model& model) noexcept {
  const std::uint32_t sample = model.sample_index(match.sample);
  return {match.sample.simulation, match.sample.time_step, sample, match.distance, model.sample_time_s(sample)};
}

lbea_result to_c(const MatchResult& result) noexcept {
  lbea_result c{};
  c.status = to_c(result.status);
  c.frame_id = result.frame_id;
  c.stamp_ns = result.stamp_ns;
  c.reference = result.reference;
  c.coverage = result.coverage;
  c.coefficients = result.coefficients.data();
  c.coefficient_count = static_cast<std::uint32_t>(result.coefficients.size());
  c.points_received = result.points.received;
  c.points_invalid = result.points.invalid;
  c.points_culled = result.points.culled;
  c.points_used = result.points.used;
  c.index_ns = result.elapsed_ns.index;
  c.correspondence_ns = result.elapsed_ns.correspondence;
  c.projection_ns = result.elapsed_ns.projection;
  c.matching_ns = result.elapsed_ns.matching;
  c.coverage_ns = result.elapsed_ns.coverage;
  return c;
}

/// Opens by `open`, a call that returns a Model; `source` is what it reads.
template <typename Open>
lbea_status open_model(const void* source, lbea_model** model, Open&& open) noexcept {
  if (model == nullptr) return bad_argument("lbea_model_open: model is NULL; give the address of a pointer");
  *model = nullptr;
  if (source == nullptr) return bad_argument("lbea_model_open: the path or image is NULL; give a file's name or a model's bytes");
  return guarded([&] {
    *model = new lbea_model(open());
    return LBEA_OK;
  });
}

lbea_status refuse(lbea_result* result, std::string_view sentence) noexcept {
  lbea_result empty{};
  empty.status = LBEA_BAD_ARGUMENT;
  write_c_struct(empty, result);
  return bad_argument(sentence);
}

}  // namespace

}  // namespace lbea

using namespace lbea;

lbea_status lbea_model_open(const char* path, lbea_model** model) {
  return open_model(path, model, [&] { return Model::open(path); });
}

lbea_status lbea_model_open_memory(const void* image, size_t size, lbea_model** model) {
  return open_model(image, model, [&] { return Model::view({static_cast<const std::byte*>(image), size}); });
}

void lbea_model_close(lbea_model* model) { delete model; }

lbea_status lbea_model_get_info(const lbea_model* model, lbea_model_info* info) {
  if (model == nullptr || info == nullptr) return bad_argument("lbea_model_get_info: model or info is NULL");
  if (!is_plausible_size(info->struct_size, least_model_info)) return bad_argument(size_not_set);
  const Model& m = model->model;
  write_c_struct({0, m.vertices(), m.modes(), m.samples(), m.simulations(), m.references(), m.nodes(), m.elements(), m.fields(),
                  m.checksum(), model->length_unit.c_str()}, info);
  return LBEA_OK;
}

lbea_status lbea_model_get_field(const lbea_model* model, uint32_t field, lbea_field_info* info) {
  if (model == nullptr || info == nullptr) return bad_argument("lbea_model_get_field: model or info is NULL");
  if (!is_plausible_size(info->struct_size, least_field_info)) return bad_argument(size_not_set);
  const Model& m = model->model;
  if (field >= m.fields()) return bad_argument("lbea_model_get_field: no such field; give less than lbea_model_info.fields");
  const bool per_element = m.field(field).location == FieldInfo::Location::element;
  const auto& [name, unit] = model->fields[field];
  write_c_struct({0, per_element ? m.elements() : m.nodes(), name.c_str(), unit.c_str()}, info);
  return LBEA_OK;
}

const char* lbea_model_simulation_name(const lbea_model* model, uint32_t simulation) {
  if (model == nullptr || simulation >= model->simulation_names.size()) return nullptr;
  return model->simulation_names[simulation].c_str();
}

const float* lbea_model_node_positions(const lbea_model* model, uint32_t sample) {
  if (model == nullptr || sample >= model->model.samples()) return nullptr;
  return model->model.node_positions(sample).data();
}

const float* lbea_model_field_values(const lbea_model* model, uint32_t field, uint32_t sample) {
  if (model == nullptr || field >= model->model.fields() || sample >= model->model.samples()) return nullptr;
  return model->model.field_values(field, sample).data();
}

lbea_status lbea_config_init(lbea_config* config, size_t struct_size) {
  if (config == nullptr) return bad_argument("lbea_config_init: config is NULL");
  if (struct_size > largest_c_struct || !is_plausible_size(static_cast<std::uint32_t>(struct_size), least_config))
    return bad_argument(size_not_set);
  config->struct_size = static_cast<std::uint32_t>(struct_size);
  write_c_struct(to_c(MatcherConfig{}), config);
  return LBEA_OK;
}

lbea_status lbea_matcher_create(const lbea_model* model, const lbea_config* config, lbea_matcher** matcher) {
  if (matcher == nullptr) return bad_argument("lbea_matcher_create: matcher is NULL; give the address of a pointer");
  *matcher = nullptr;
  if (model == nullptr) return bad_argument("lbea_matcher_create: model is NULL; open one first");
  lbea_config full = to_c(MatcherConfig{});
  if (config != nullptr) {
    if (!is_plausible_size(config->struct_size, least_config)) return bad_argument(size_not_set);
    if (!read_c_struct(config, full))
      return failed(LBEA_BAD_CONFIG, "matcher configuration: a field is set that this older library does not know");
  }
  return guarded([&] {
    *matcher = new lbea_matcher(model->model, from_c(full));
    return LBEA_OK;
  });
}

void lbea_matcher_destroy(lbea_matcher* matcher) { delete matcher; }

lbea_status lbea_matcher_match(lbea_matcher* matcher, const lbea_frame* frame, lbea_result* result) {
  if (result == nullptr) return bad_argument("lbea_matcher_match: result is NULL");
  if (!is_plausible_size(result->struct_size, least_result)) return bad_argument(size_not_set);
  if (matcher == nullptr || frame == nullptr) return refuse(result, "lbea_matcher_match: matcher or frame is NULL");
  lbea_frame full{};
  if (!is_plausible_size(frame->struct_size, least_frame)) return refuse(result, size_not_set);
  if (!read_c_struct(frame, full)) return refuse(result, "lbea_matcher_match: the frame sets a field this older library does not know");
  if (full.points == nullptr && full.point_count > 0) return refuse(result, "lbea_matcher_match: points is NULL");
  const MatchResult found = matcher->matcher.match(
      {full.id, full.stamp_ns, {reinterpret_cast<const Point*>(full.points), full.point_count}});
  lbea_result c = to_c(found);
  const Model& model = matcher->matcher.model();
  std::ranges::transform(found.matches, matcher->matches.begin(), [&](const Match& m) { return to_c(m, model); });
  c.match_count = static_cast<std::uint32_t>(found.matches.size());
  c.matches = matcher->matches.data();
  write_c_struct(c, result);
  return c.status;
}
