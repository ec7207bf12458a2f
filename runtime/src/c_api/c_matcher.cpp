// The C interface to matching.
#include "runtime/src/c_api/c_support.hpp"

namespace lbea {
namespace {
static_assert(sizeof(lbea_status) == 4 && sizeof(lbea_method) == 4 && sizeof(lbea_verdict) == 4,
              "enums are four bytes wide");
static_assert(sizeof(lbea_point) == sizeof(Point) && alignof(lbea_point) == alignof(Point));
static_assert(sizeof(lbea_channel_value) == sizeof(ChannelValue) &&
              offsetof(lbea_channel_value, bound_90) == offsetof(ChannelValue, bound_90));
static_assert(LBEA_METHOD_LBEA == static_cast<int>(Method::lbea) && LBEA_METHOD_VTP == static_cast<int>(Method::vtp) &&
              LBEA_METHOD_FIT == static_cast<int>(Method::fit));

#define LBEA_NAME(name) std::string_view(#name),
constexpr std::array c_frame_numbers{LBEA_FRAME_NUMBERS(LBEA_NAME)};
constexpr std::array c_fit_numbers{LBEA_FIT_NUMBERS(LBEA_NAME)};
#undef LBEA_NAME
template <class Info>
constexpr std::string_view name_of(const Info& info) noexcept {
  return info.name;
}
static_assert(std::ranges::equal(c_frame_numbers, frame_numbers, {}, {}, name_of<NumberInfo<FrameNumbers>>) &&
                  std::ranges::equal(c_fit_numbers, fit_numbers, {}, {}, name_of<NumberInfo<FitNumbers>>),
              "lbea.h lists the numbers of lbea.hpp");

// Sizes of the structs in the first version that had them: every caller knows at least these fields.
constexpr std::size_t least_config = offsetof(lbea_config, T_reference_sensor) + sizeof(RigidTransform);
constexpr std::size_t least_frame = offsetof(lbea_frame, point_count) + sizeof(std::size_t);
constexpr std::size_t least_result = offsetof(lbea_result, fit_ns) + sizeof(std::uint32_t);
constexpr std::size_t least_test_state = offsetof(lbea_test_state, verdict) + sizeof(lbea_verdict);

void copy_config(const auto& from, auto& to) noexcept {
  to.max_points = from.max_points;
  to.max_matches = from.max_matches;
  to.method = static_cast<decltype(to.method)>(from.method);
  to.trusted_distance = from.trusted_distance;
  to.min_coverage = from.min_coverage;
  to.trigger_ns = from.trigger_ns;
  std::ranges::copy(from.T_reference_sensor, std::begin(to.T_reference_sensor));
}

lbea_config to_c(const MatcherConfig& config) noexcept {
  lbea_config c{};
  copy_config(config, c);
  return c;
}

static_assert(LBEA_VERDICT_UNKNOWN == static_cast<int>(Verdict::unknown) &&
              LBEA_VERDICT_MATCHED == static_cast<int>(Verdict::matched) &&
              LBEA_VERDICT_AMBIGUOUS == static_cast<int>(Verdict::ambiguous) &&
              LBEA_VERDICT_NO_SIMULATION_FITS == static_cast<int>(Verdict::no_simulation_fits));

lbea_match to_c(const Match& match, const Model& model) noexcept {
  const std::uint32_t sample = model.sample_index(match.sample);
  return {match.sample.simulation, match.sample.time_step, sample, match.distance, model.sample_time_s(sample)};
}

// All but the lists, which need the matcher's memory.
lbea_result to_c(const MatchResult& result) noexcept {
  lbea_result c{};
  c.status = to_c(result.status);
  c.verdict = to_c(result.verdict);
  c.frame_id = result.frame_id;
  c.stamp_ns = result.stamp_ns;
  c.reference = result.reference;
  c.coefficients = result.coefficients.data();
  c.coefficient_count = static_cast<std::uint32_t>(result.coefficients.size());
  std::ranges::copy(result.leading_coordinates, c.leading_coordinates);
#define LBEA_COPY(name) c.name = result.name;
  LBEA_FRAME_NUMBERS(LBEA_COPY)
#undef LBEA_COPY
#define LBEA_COPY(name) c.name = result.fit.name;
  LBEA_FIT_NUMBERS(LBEA_COPY)
#undef LBEA_COPY
  c.channel_count = static_cast<std::uint32_t>(result.channels.size());
  c.channels = reinterpret_cast<const lbea_channel_value*>(result.channels.data());
  c.points_received = result.points.received;
  c.points_invalid = result.points.invalid;
  c.points_culled = result.points.culled;
  c.points_used = result.points.used;
  c.index_ns = result.elapsed_ns.index;
  c.correspondence_ns = result.elapsed_ns.correspondence;
  c.projection_ns = result.elapsed_ns.projection;
  c.matching_ns = result.elapsed_ns.matching;
  c.coverage_ns = result.elapsed_ns.coverage;
  c.fit_ns = result.elapsed_ns.fit;
  return c;
}

void add_lists(CResult& m, lbea_result& c) noexcept {
  const auto match = [&](const Match& from) { return to_c(from, m.model); };
  const auto share = [&](const WeightedSample& from) {
    return lbea_weighted_sample{m.model.sample_index(from.sample), from.weight};
  };
  std::ranges::transform(m.last.matches, m.matches.begin(), match);
  std::ranges::transform(m.last.fit.candidates, m.candidates.begin(), match);
  std::ranges::transform(m.last.fit.estimate, m.estimate.begin(), share);
  c.matches = m.matches.data();
  c.match_count = static_cast<std::uint32_t>(m.last.matches.size());
  c.candidates = m.candidates.data();
  c.candidate_count = static_cast<std::uint32_t>(m.last.fit.candidates.size());
  c.estimate = m.estimate.data();
  c.estimate_count = static_cast<std::uint32_t>(m.last.fit.estimate.size());
}

/// history: null to match the frame alone.
lbea_status match(lbea_matcher* matcher, const lbea_frame* frame, TestHistory* history, lbea_result* result) noexcept {
  constexpr std::string_view is_null = "lbea_matcher_match: matcher or frame is NULL";
  Frame given;
  const bool has_both = matcher != nullptr && frame != nullptr;
  if (const auto refusal = begin_result(result, has_both ? read(*frame, given) : is_null); refusal != LBEA_OK)
    return refusal;
  return matcher->result.write(
      history == nullptr ? matcher->matcher.match(given) : matcher->matcher.match(given, *history), result);
}

lbea_test_state to_c(const TestState& now, const Model& model) {
  lbea_test_state c{};
  c.frames = now.frames;
  c.sample = model.sample_index(now.sample);
  c.sample_probability = now.sample_probability;
  c.simulation = now.simulation;
  c.simulation_probabilities = now.simulation_probabilities.data();
  c.simulation_count = static_cast<std::uint32_t>(now.simulation_probabilities.size());
  c.misfit = now.misfit;
  c.verdict = to_c(now.verdict);
  return c;
}

/// result: null for no matcher.
lbea_status update(lbea_tracker* tracker, const CResult* result, lbea_test_state* state) noexcept {
  if (tracker == nullptr || result == nullptr || state == nullptr)
    return bad_argument("lbea_tracker_update: tracker, matcher or state is NULL");
  if (!is_plausible_size(state->struct_size, least_test_state)) return bad_argument(size_not_set);
  if (result->model.checksum() != tracker->model_checksum)
    return bad_argument(
        "lbea_tracker_update: the matcher is of another model; create the tracker with the matcher's model");
  write_c_struct(to_c(tracker->tracker.update(result->last), result->model), state);
  return LBEA_OK;
}
}  // namespace

lbea_verdict to_c(Verdict verdict) noexcept { return static_cast<lbea_verdict>(verdict); }

lbea_status read(const lbea_config* config, MatcherConfig& into) noexcept {
  lbea_config full = to_c(MatcherConfig{});
  if (config != nullptr) {
    if (!is_plausible_size(config->struct_size, least_config)) return bad_argument(size_not_set);
    if (!read_c_struct(config, full))
      return failed(LBEA_BAD_CONFIG, "matcher configuration: a field is set that this older library does not know");
  }
  copy_config(full, into);
  return LBEA_OK;
}

std::string_view read(const lbea_frame& frame, Frame& into) noexcept {
  lbea_frame full{};
  if (!is_plausible_size(frame.struct_size, least_frame)) return size_not_set;
  if (!read_c_struct(&frame, full)) return "the frame sets a field this older library does not know";
  if (full.points == nullptr && full.point_count > 0) return "the frame's points are NULL";
  into = {full.id, full.stamp_ns, {reinterpret_cast<const Point*>(full.points), full.point_count}};
  return {};
}

lbea_status begin_result(lbea_result* result, std::string_view wrong) noexcept {
  if (result == nullptr) return bad_argument("result is NULL");
  if (!is_plausible_size(result->struct_size, least_result)) return bad_argument(size_not_set);
  if (wrong.empty()) return LBEA_OK;
  lbea_result empty{};
  empty.status = LBEA_BAD_ARGUMENT;
  write_c_struct(empty, result);
  return bad_argument(wrong);
}

lbea_status CResult::write(const MatchResult& result, lbea_result* into) noexcept {
  last = result;
  lbea_result c = to_c(result);
  add_lists(*this, c);
  write_c_struct(c, into);
  return c.status;
}
}  // namespace lbea

using namespace lbea;

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
  MatcherConfig full;
  if (const lbea_status refusal = read(config, full); refusal != LBEA_OK) return refusal;
  return guarded([&] {
    *matcher = new lbea_matcher(model->model, full);
    return LBEA_OK;
  });
}

void lbea_matcher_destroy(lbea_matcher* matcher) { delete matcher; }

lbea_status lbea_matcher_match(lbea_matcher* matcher, const lbea_frame* frame, lbea_result* result) {
  return match(matcher, frame, nullptr, result);
}

lbea_status lbea_matcher_match_with_history(lbea_matcher* matcher, const lbea_frame* frame, lbea_test_history* history,
                                            lbea_result* result) {
  if (history == nullptr)
    return begin_result(result, "lbea_matcher_match_with_history: history is NULL; create one first");
  if (matcher != nullptr && matcher->matcher.model().checksum() != history->model_checksum)
    return begin_result(result,
                        "lbea_matcher_match_with_history: the history is of another model; create it with the "
                        "matcher's model");
  return match(matcher, frame, &history->history, result);
}

lbea_status lbea_tracker_create(const lbea_model* model, lbea_tracker** tracker) {
  if (tracker == nullptr) return bad_argument("lbea_tracker_create: tracker is NULL; give the address of a pointer");
  *tracker = nullptr;
  if (model == nullptr) return bad_argument("lbea_tracker_create: model is NULL; open one first");
  return guarded([&] {
    *tracker = new lbea_tracker(model->model);
    return LBEA_OK;
  });
}

void lbea_tracker_destroy(lbea_tracker* tracker) { delete tracker; }

lbea_status lbea_tracker_update(lbea_tracker* tracker, const lbea_matcher* matcher, lbea_test_state* state) {
  return update(tracker, matcher == nullptr ? nullptr : &matcher->result, state);
}

lbea_status lbea_tracker_update_by_rigs(lbea_tracker* tracker, const lbea_rig_matcher* matcher,
                                        lbea_test_state* state) {
  return update(tracker, matcher == nullptr ? nullptr : &matcher->result, state);
}
