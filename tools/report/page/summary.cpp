// The report for programs.
#include "tools/report/page/page.hpp"

#include "adapters/wire/codec/codec.hpp"

#include <nlohmann/json.hpp>

#include <array>
#include <cmath>

namespace lbea::tool {
namespace {

using Json = nlohmann::ordered_json;

Json number(double value) { return std::isfinite(value) ? Json(value) : Json(nullptr); }

Json reasons(std::span<const Accounts::Reason> all) {
  Json json = Json::object();
  for (const auto& [status, count] : all) json[std::string(wire::to_string(status))] = count;
  return json;
}

Json accounts_json(const TestReport& report) {
  const wire::Counters& counters = report.accounts.counters;
  return {{"captured", counters.captured()},
          {"received", counters.received},
          {"matched", counters.sum(wire::Fate::matched)},
          {"rejected", counters.sum(wire::Fate::rejected)},
          {"dropped", counters.sum(wire::Fate::dropped)},
          {"rejected_by_reason", reasons(report.accounts.rejected)},
          {"dropped_by_reason", reasons(report.accounts.dropped)},
          {"by_matcher", report.accounts.is_by_matcher}};
}

Json test_json(const TestReport& report, const RecordedTest& test) {
  const wire::WireTestState& state = test.record.answer().state();
  Json json{{"session", hexadecimal_text(test.key.first)},
            {"matched_frames", test.record.answer().matched()},
            {"seconds", number(test.record.seconds())},
            {"ended", test.record.has_ended()},
            {"verdict", wire::to_string(state.verdict)},
            {"misfit", state.frames > 0 ? number(double{state.misfit}) : Json(nullptr)},
            {"simulations", Json::array()},
            {"branches", state.branches}};
  for (const auto& [simulation, probability] : state.simulations)
    json["simulations"].push_back(
        {{"simulation", simulation_name(report.names, simulation)}, {"probability", number(double{probability})}});
  for (const auto& [verdict, count] : test.record.verdicts())
    json["verdicts"][std::string(wire::to_string(verdict))] = count;
  return json;
}

Json end_json(const TestReport& report) {
  if (report.record() == nullptr) return nullptr;
  const wire::WireResult& last = *report.record()->latest();
  Json json{{"frame", last.frame_id}};
  if (!last.matches.empty()) {
    json["simulation"] = last.matches.front().simulation_name;
    json["time_step"] = last.matches.front().sample.time_step;
    json["time_s"] = number(last.matches.front().time_s);
    json["distance"] = number(double{last.matches.front().distance});
  }
  for (const auto& entry : frame_numbers) json[entry.name] = number(double{last.*entry.value});
  for (const auto& entry : fit_numbers) json[entry.name] = number(double{last.fit.*entry.value});
  return json;
}

Json frames_json(const TestReport& report) {
  Json frames = Json::array();
  for (const StudiedFrame& frame : report.frames.frames)
    frames.push_back({{"frame", frame.result.frame_id},
                      {"seconds", number(frame.time_s)},
                      {"shown", frame.is_shown},
                      {"mean_to_match", number(frame.to_match.mean())},
                      {"mean_to_estimate", number(frame.to_estimate.mean())}});
  return frames;
}

Json regions_json(const TestReport& report) {
  Json regions = Json::array();
  for (const Region& region : report.regions.worst)
    regions.push_back(
        {{"part", region.part},
         {"center",
          {number(double{region.center.x}), number(double{region.center.y}), number(double{region.center.z})}},
         {"mean", number(region.mean)},
         {"highest", number(region.highest)},
         {"highest_seconds", number(region.highest_time_s)}});
  return regions;
}

Json moment_json(const std::optional<ChannelMoment>& moment) {
  if (!moment) return nullptr;
  return {{"seconds", number(moment->time_s)},
          {"value", number(double{moment->value})},
          {"bound_90", number(double{moment->bound_90})}};
}

/// Null, with the reason beside it, without a rating.
Json rating_json(const std::optional<ObjectiveRating>& rating) {
  if (!rating) return nullptr;
  return {{"overall", rating->overall},
          {"grade", grade_of(rating->overall)},
          {"corridor", rating->corridor},
          {"phase", rating->phase},
          {"magnitude", rating->magnitude},
          {"slope", rating->slope},
          {"simulation_is_late_by_s", static_cast<double>(rating->shift.values) / rating_frequency_hz}};
}

Json channels_json(const TestReport& report) {
  Json json = Json::array();
  if (report.record() == nullptr) return json;
  for (const TestChannel& channel : report.record()->channels().channels()) {
    const std::size_t place = json.size();
    json.push_back({{"name", channel.name},
                    {"unit", channel.unit},
                    {"last", moment_json(channel.last)},
                    {"peak", moment_json(channel.peak)}});
    if (place >= report.channels.channels.size()) continue;
    const StudiedChannel& studied = report.channels.channels[place];
    json.back()["rating"] = rating_json(studied.rating);
    if (!studied.rating) json.back()["not_rated_because"] = studied.why_not;
  }
  return json;
}

Json rated_simulation_json(const TestReport& report) {
  const ChannelStudy& study = report.channels;
  if (!study.simulation) return nullptr;
  return {{"simulation", simulation_name(report.names, *study.simulation)},
          {"impact_seconds", study.impact_s ? number(*study.impact_s) : Json(nullptr)}};
}

/// Null: undecided.
Json acceptable_json(FieldAgreement agreement) {
  return agreement == FieldAgreement::undecided ? Json(nullptr) : Json(agreement == FieldAgreement::acceptable);
}

/// CWA 16799.
Json fields_json(const TestReport& report) {
  const FieldComparison& fields = report.fields;
  if (fields.frames.empty()) return {{"not_compared_because", fields.why_not}};
  Json frames = Json::array();
  for (const ComparedFields& frame : fields.frames)
    frames.push_back({{"seconds", number(frame.time_s)},
                      {"coefficients", frame.differences.size()},
                      {"within_two_u", frame.agreeing()},
                      {"largest_difference", number(frame.differences[frame.largest()])},
                      {"u", number(frame.uncertainty())},
                      {"average_residual", number(frame.average_residual)},
                      {"deviation_of_simulations", number(frame.spread)},
                      {"acceptable", acceptable_json(frame.agreement())}});
  return {{"acceptable", acceptable_json(fields.agreement())},
          {"simulation", simulation_name(report.names, *report.channels.simulation)},
          {"frames", std::move(frames)}};
}

/// After the last frame, and the error of the forecasts before.
Json forecast_json(const TestReport& report) {
  const wire::WireForecast& last = report.forecast();
  if (last.frames == 0) return nullptr;
  Json json{{"error_90", number(double{last.error_90})},
            {"branches", last.branches},
            {"parameters", Json::array()},
            {"compared", report.forecasts.is_compared()},
            {"moments", Json::array()}};
  for (std::uint32_t p = 0; p < report.parameters(); ++p) {
    const ParameterForecast& forecast = last.parameters[p];
    json["parameters"].push_back({{"name", report.model.parameter_name(p)},
                                  {"value", number(double{forecast.value})},
                                  {"bound_90", number(double{forecast.bound_90})},
                                  {"r2", number(double{forecast.r2})},
                                  {"identifiable", forecast.is_identifiable()}});
  }
  for (const ForecastMoment& moment : report.forecasts.moments)
    json["moments"].push_back({{"seconds", number(moment.time_s)},
                               {"error_90", number(moment.error_90)},
                               {"error", number(moment.distance)}});
  return json;
}

Json answer_json(const Explanation& answer) {
  return {{"word", answer.word}, {"headline", answer.headline}, {"meaning", answer.meaning}, {"action", answer.action}};
}

Json summary_of(const TestReport& report) {
  const RunAudit& audit = report.content.audit;
  Json json{{"recording", report.content.file.string()},
            {"checksum", hexadecimal_text(report.content.checksum)},
            {"intact", audit.file.is_intact()},
            {"complete", audit.is_complete()},
            {"flaws", audit.flaws()},
            {"recorded_by", report.settings().program},
            {"method", report.settings().method},
            {"model", report.model_file.string()},
            {"model_checksum", hexadecimal_text(report.model.checksum())},
            {"length_unit", report.length_unit()},
            {"program", "lbea-report " LBEA_VERSION_STRING},
            {"answer", answer_json(report.explanation)},
            {"frame_misfit_limit", number(report.frame_limit)},
            {"test_misfit_limit", number(report.test_limit)},
            {"warnings", report.warnings},
            {"accounts", accounts_json(report)},
            {"test", report.test ? Json(*report.test + 1) : Json(nullptr)},
            {"tests", Json::array()},
            {"end", end_json(report)},
            {"forecast", forecast_json(report)},
            {"channels", channels_json(report)},
            {"channels_rated_against", rated_simulation_json(report)},
            {"channel_frames_left_out", report.record() == nullptr ? 0 : report.record()->channels().left_out()},
            {"displacements", fields_json(report)},
            {"frames", frames_json(report)},
            {"regions", regions_json(report)}};
  for (const RecordedTest& test : report.content.tests) json["tests"].push_back(test_json(report, test));
  if (!report.component.empty()) json["component"] = report.component;
  return json;
}

/// What is of the whole recording once, the rest for each component.
Json joint_summary(std::span<const TestReport> components) {
  constexpr std::array<const char*, 9> shared{"recording",   "checksum", "intact",  "complete", "flaws",
                                              "recorded_by", "method",   "program", "accounts"};
  Json joint, list = Json::array();
  for (const TestReport& report : components) {
    Json summary = summary_of(report);
    for (const char* key : shared) {
      joint[key] = summary[key];
      summary.erase(key);
    }
    list.push_back(std::move(summary));
  }
  joint["answer"] = answer_json(explain_together(components));
  joint["components"] = std::move(list);
  return joint;
}

}  // namespace

std::string summary_json(std::span<const TestReport> reports) {
  const Json json = reports.size() == 1 ? summary_of(reports.front()) : joint_summary(reports);
  return json.dump(2, ' ', false, Json::error_handler_t::replace);
}

}  // namespace lbea::tool
