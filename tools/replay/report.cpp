#include "tools/replay/report.hpp"

#include "adapters/wire/codec/codec.hpp"
#include "tools/shared/answer/test_answer.hpp"
#include "tools/shared/matching/result_json.hpp"
#include "tools/shared/text/formatted.hpp"

#include <nlohmann/json.hpp>

#include <algorithm>
#include <cmath>
#include <system_error>

namespace lbea::tool {
namespace {

using Json = nlohmann::ordered_json;
constexpr std::size_t chunk_bytes = std::size_t{1} << 20;

unsigned long long number(std::uint64_t value) { return value; }

}  // namespace

std::string result_header() {
  return formatted("%10s  %-16s %5s %14s %9s %8s  %s", "frame", "best simulation", "step", "distance", "error_90",
                   "coverage", "verdict");
}

std::string result_line(const wire::WireResult& result) {
  const std::string verdict(wire::fate_of(result.status) == wire::Fate::matched ? wire::to_string(result.verdict)
                                                                                : wire::to_string(result.status));
  if (result.matches.empty())
    return formatted("%10llu  %-16s %5s %14s %9s %8s  %s", number(result.frame_id), "-", "-", "-", "-", "-",
                     verdict.c_str());
  const wire::WireMatch& best = result.matches[0];
  const std::string error_90 =
      std::isfinite(result.fit.error_90) ? formatted("%.3g", static_cast<double>(result.fit.error_90)) : "-";
  return formatted(
      "%10llu  %-16s %5u %14.6g %9s %8.3f  %s%s", number(result.frame_id), best.simulation_name.c_str(),
      best.sample.time_step, static_cast<double>(best.distance), error_90.c_str(), static_cast<double>(result.coverage),
      (verdict + (result.component.empty() ? "" : " of " + result.component)).c_str(), by_rigs(result).c_str());
}

std::string result_json(const wire::WireResult& result) {
  Json matches = Json::array();
  for (const wire::WireMatch& match : result.matches)
    matches.push_back({{"simulation", match.simulation_name},
                       {"time_step", match.sample.time_step},
                       {"time_s", match.time_s},
                       {"distance", match.distance}});
  Json json{{"session", result.session},
            {"frame", result.frame_id},
            {"stamp_ns", result.stamp_ns},
            {"status", wire::to_string(result.status)},
            {"verdict", wire::to_string(result.verdict)}};
  for (const auto& number : frame_numbers) json[number.name] = result.*number.value;
  json["matches"] = std::move(matches);
  if (!result.component.empty()) json["component"] = result.component;
  add_details(json, result);
  return json.dump(-1, ' ', false, Json::error_handler_t::replace);  // names may not be UTF-8
}

std::string comparison_line(const ComparisonTally& tally) {
  return formatted(
      "%llu results the same, %llu different (%llu with another match, %llu with another status or verdict, "
      "%llu with other quantities of interest); %llu without a recorded result, %llu recorded ones without a new one, "
      "%llu not compared because their test began "
      "before the recording; largest relative difference of a best distance %.3g",
      number(tally.same), number(tally.different), number(tally.other_match), number(tally.other_status),
      number(tally.other_channels), number(tally.not_recorded), number(tally.not_repeated),
      number(tally.without_history), tally.worst_distance);
}

std::string comparison_json(const ComparisonTally& tally) {
  return Json{{"same", tally.same},
              {"different", tally.different},
              {"other_match", tally.other_match},
              {"other_status", tally.other_status},
              {"other_channels", tally.other_channels},
              {"not_recorded", tally.not_recorded},
              {"not_repeated", tally.not_repeated},
              {"edge_frames", tally.edge_frames},
              {"edge_results", tally.edge_results},
              {"without_history", tally.without_history},
              {"worst_distance", tally.worst_distance}}
      .dump();
}

ResultsFile::ResultsFile(const std::filesystem::path& file, const RunSettings& settings)
    : name_(file.string()), sink_(file), writer_(sink_) {
  const auto schema = wire::result_schema();
  check(writer_.begin({"lbea.results", "lbea " LBEA_VERSION_STRING}));
  check(writer_.metadata(to_metadata(settings)));
  for (std::size_t i = 0; i < settings.components.size(); ++i)
    check(writer_.metadata(to_metadata(settings.components[i], i)));
  check(writer_.define(
      mcap::Schema{results_schema_id, "lbea.wire.Result", "flatbuffer", {schema.begin(), schema.end()}}));
  check(
      writer_.define(mcap::Channel{results_channel, results_schema_id, std::string(results_topic), "flatbuffer", {}}));
}

void ResultsFile::add(const wire::WireResult& result) {
  const auto time = static_cast<std::uint64_t>(std::max<std::int64_t>(result.receive_ns, 0));
  mcap::append(waiting_, mcap::Message{results_channel, static_cast<std::uint32_t>(result.sequence), time, time,
                                       encoder_.result(result)});
  if (waiting_.size() >= chunk_bytes) write_chunk();
}

void ResultsFile::finish() {
  write_chunk();
  check(writer_.finish());
  check(sink_.commit());
}

void ResultsFile::write_chunk() {
  if (waiting_.empty()) return;
  const mcap::Bytes piece = waiting_;
  check(writer_.chunk({&piece, 1}));
  waiting_.clear();
}

void ResultsFile::check(int error) const {
  if (error != 0)
    throw Error(Status::write_failed, "cannot write " + name_ + ": " + std::generic_category().message(error) +
                                          "; check the folder and the free space");
}

}  // namespace lbea::tool
