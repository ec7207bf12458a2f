#include "tools/shared/matching/match_engine.hpp"

#include "runtime/src/match/matcher.hpp"
#include "tools/shared/matching/named_models.hpp"

#include <algorithm>

namespace lbea::tool {
namespace {

constexpr std::size_t max_chances = 8, max_candidates = 64, max_branches = 64;
constexpr std::size_t max_runs = 512, max_parameters = 64;  // of a forecast

wire::WireVerdict verdict_of(wire::WireStatus status) noexcept {
  if (status == wire::WireStatus::low_coverage) return wire::WireVerdict::low_coverage;
  return wire::fate_of(status) == wire::Fate::rejected ? wire::WireVerdict::refused : wire::WireVerdict::unknown;
}

wire::WireVerdict to_wire(Verdict verdict) noexcept {
  if (verdict == Verdict::matched) return wire::WireVerdict::matched;
  if (verdict == Verdict::ambiguous) return wire::WireVerdict::ambiguous;
  return verdict == Verdict::unknown ? wire::WireVerdict::unknown : wire::WireVerdict::no_simulation_fits;
}

Verdict from_wire(wire::WireVerdict verdict) noexcept {
  if (verdict == wire::WireVerdict::matched) return Verdict::matched;
  if (verdict == wire::WireVerdict::ambiguous) return Verdict::ambiguous;
  return verdict == wire::WireVerdict::no_simulation_fits ? Verdict::no_simulation_fits : Verdict::unknown;
}

// The likeliest simulations, best first, in reserved memory.
void rank(std::span<const float> probabilities, std::vector<wire::SimulationChance>& chances) noexcept {
  chances.clear();
  for (std::uint32_t i = 0; i < probabilities.size(); ++i) {
    const auto place = std::ranges::find_if(
        chances, [&](const wire::SimulationChance& c) { return c.probability < probabilities[i]; });
    if (chances.size() == max_chances) {
      if (place == chances.end()) continue;
      std::copy_backward(place, chances.end() - 1, chances.end());
      *place = {i, probabilities[i]};
    } else {
      chances.insert(place, {i, probabilities[i]});
    }
  }
}

void fill(wire::WireFit& fit, const SurfaceFit& from) noexcept {
  if (from.candidates.empty()) return;
  static_cast<FitNumbers&>(fit) = from;
  fit.candidates.assign(from.candidates.begin(), from.candidates.end());
  fit.ranks.assign(from.ranks.begin(), from.ranks.end());
  fit.estimate.assign(from.estimate.begin(), from.estimate.end());
}

void fill(wire::WireTestState& test, const TestState& from) noexcept {
  if (from.frames == 0) return;
  test.frames = from.frames;
  test.simulation = from.simulation;
  test.sample = from.sample;
  test.sample_probability = from.sample_probability;
  test.misfit = from.misfit;
  test.verdict = to_wire(from.verdict);
  rank(from.simulation_probabilities, test.simulations);
  test.branches.assign(from.branch_probabilities.begin(), from.branch_probabilities.end());
}

void fill(wire::WireForecast& forecast, const TestForecast& from) noexcept {
  forecast.frames = from.frames;
  forecast.error_90 = from.error_90;
  for (std::uint32_t run = 0; run < from.run_weights.size(); ++run)
    if (from.run_weights[run] != 0) forecast.runs.push_back({run, from.run_weights[run]});
  forecast.branches.assign(from.branch_probabilities.begin(), from.branch_probabilities.end());
  forecast.parameters.assign(from.parameters.begin(), from.parameters.end());
}

/// The same vector, empty, with its memory.
template <class T>
std::vector<T> emptied(std::vector<T>& vector) noexcept {
  vector.clear();
  return std::move(vector);
}

}  // namespace

/// match() returns no other status.
wire::WireStatus to_wire(Status status) noexcept {
  if (status == Status::ok) return wire::WireStatus::ok;
  if (status == Status::low_coverage) return wire::WireStatus::low_coverage;
  return status == Status::too_many_points ? wire::WireStatus::too_many_points : wire::WireStatus::empty_frame;
}

TestHistory history_for(const Model& model, const MatcherConfig& config, const SensorViews& views,
                        const HistorySettings& settings) {
  TestHistory history(model, views);
  if (!settings.estimates_pose) history.fix_pose();
  if (settings.knows_impact) history.set_impact(config.trigger_ns);
  return history;
}

bool has_pose_of(const SensorViews& views, const Model& model) noexcept {
  return views.empty() || is_baked(views, model.view());
}

double time_of(Sample sample, const Model& model) noexcept {
  const std::uint32_t index = model.sample_index(sample);
  return index < model.samples() ? model.sample_time_s(index) : 0;
}

wire::ModelSummary summarize(const Model& model, const std::string& file) {
  return {file,
          model.checksum(),
          model.vertices(),
          model.modes(),
          model.samples(),
          model.references(),
          std::string(model.length_unit()),
          simulation_names(model)};
}

void reserve(Outcome& outcome, std::uint32_t max_matches) {
  outcome.matches.reserve(max_matches);
  outcome.channels.reserve(most_channels);
  outcome.ends.reserve(most_channels);
  outcome.result.fit.candidates.reserve(max_candidates);
  outcome.result.fit.ranks.reserve(max_candidates);
  outcome.result.fit.estimate.reserve(max_candidates);
  outcome.result.test.simulations.reserve(max_chances);
  outcome.result.test.branches.reserve(max_branches);
  outcome.result.forecast.runs.reserve(max_runs);
  outcome.result.forecast.branches.reserve(max_branches);
  outcome.result.forecast.parameters.reserve(max_parameters);
  outcome.result.rigs.reserve(wire::most_rigs);
}

void clear(Outcome& outcome) noexcept {
  outcome.matches.clear();
  outcome.channels.clear();
  outcome.ends.clear();
  outcome.component = 0;
  outcome.of_frame.reset();
  wire::WireResult& result = outcome.result;
  wire::WireResult fresh;
  fresh.fit.candidates = emptied(result.fit.candidates);
  fresh.fit.ranks = emptied(result.fit.ranks);
  fresh.fit.estimate = emptied(result.fit.estimate);
  fresh.test.simulations = emptied(result.test.simulations);
  fresh.test.branches = emptied(result.test.branches);
  fresh.forecast.runs = emptied(result.forecast.runs);
  fresh.forecast.branches = emptied(result.forecast.branches);
  fresh.forecast.parameters = emptied(result.forecast.parameters);
  fresh.rigs = emptied(result.rigs);
  result = std::move(fresh);
}

void fill_outcome(Outcome& outcome, const MatchResult& match) noexcept {
  wire::WireResult& result = outcome.result;
  result.status = to_wire(match.status);
  result.reference = match.reference;
  static_cast<FrameNumbers&>(result) = match;
  result.points = match.points;
  result.elapsed_ns.match = match.elapsed_ns;
  result.leading_coordinates = match.leading_coordinates;
  result.verdict = to_wire(match.verdict);
  outcome.matches.assign(match.matches.begin(), match.matches.end());
  outcome.channels.assign(match.channels.begin(), match.channels.end());
  fill(result.fit, match.fit);
}

void fill_rig_frame(wire::WireRigFrame& frame, const RigResult& result) noexcept {
  static_cast<FitNumbers&>(frame) = result;
  static_cast<FrameNumbers&>(frame) = result;
  frame.status = to_wire(result.status);
  frame.verdict = to_wire(result.verdict);
  frame.points = result.points;
  frame.is_used = result.is_used;
  frame.clock_correction_ns = result.clock_correction_ns;
}

MatchResult match_of(const Outcome& outcome) noexcept {
  MatchResult match;
  match.frame_id = outcome.result.frame_id;
  match.stamp_ns = outcome.result.stamp_ns;
  match.status = outcome.result.status == wire::WireStatus::ok             ? Status::ok
                 : outcome.result.status == wire::WireStatus::low_coverage ? Status::low_coverage
                                                                           : Status::empty_frame;
  match.verdict = from_wire(outcome.result.verdict);
  match.matches = outcome.matches;
  match.fit = outcome.result.fit.view();
  return match;
}

void fill_test(Outcome& outcome, TestEngine& engine, const MatchResult& match) noexcept {
  if (const TestState* test = engine.track(match)) fill(outcome.result.test, *test);
  const TestForecast* forecast = engine.forecast(match);
  if (forecast == nullptr || forecast->frames == 0) return;
  fill(outcome.result.forecast, *forecast);
  engine.replace_rates(match, outcome.channels);
  for (const ChannelForecast& channel : forecast->channels)
    outcome.ends.push_back(
        {channel.final_value, engine.has_baked_pose() ? channel.final_bound_90 : ChannelValue{}.bound_90});
}

void fill_capture(Outcome& outcome, TestEngine& engine, MatchResult match, std::uint64_t session,
                  std::uint64_t id) noexcept {
  fill_outcome(outcome, match);
  outcome.result.session = session;
  outcome.result.frame_id = match.frame_id = id;
  outcome.result.stamp_ns = match.stamp_ns;
  fill_test(outcome, engine, match);
}

void compose(const Outcome& outcome, const TestEngine& engine, wire::WireResult& into) {
  into = outcome.result;
  for (const Match& match : outcome.matches)
    into.matches.push_back({match.sample, std::string(engine.simulation_name(match.sample.simulation)),
                            engine.time_s(match.sample), match.distance});
  for (std::uint32_t c = 0; c < outcome.channels.size(); ++c) {
    const ChannelInfo info = engine.channel(c);
    const ChannelValue end = c < outcome.ends.size() ? outcome.ends[c] : ChannelValue{};
    into.channels.push_back({outcome.channels[c], std::string(info.name), std::string(info.unit), end});
  }
}

void complete_verdict(wire::WireResult& result) noexcept {
  if (result.verdict == wire::WireVerdict::unknown) result.verdict = verdict_of(result.status);
}

}  // namespace lbea::tool
