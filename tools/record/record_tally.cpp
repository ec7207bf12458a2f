#include "tools/record/record_tally.hpp"

#include "tools/shared/intake/log.hpp"
#include "tools/shared/text/last_line.hpp"

#include <nlohmann/json.hpp>

namespace lbea::tool {
namespace {

using Json = nlohmann::ordered_json;

void add_account(Json& json, const RecordTally& tally) {
  json["damaged"] = tally.damaged;
  json["too_many_points"] = tally.too_many_points;
  json["forwarded"] = tally.forwarded;
  json["refused"] = tally.refused;
  json["undelivered"] = tally.undelivered;
  json["missed"] = tally.missed;
  json["withheld"] = tally.withheld;
  json["silent"] = tally.silent;
  json["interleaved"] = tally.interleaved;
}

std::string line_of(const Json& json) {
  std::string line;
  for (const auto& [key, value] : json.items()) line += (line.empty() ? "" : ", ") + key + " " + value.dump();
  return line;
}

/// rig: its name; empty for the only one. lost_results: counted once.
void warn_of_losses(const std::string& file, const RecordTally& tally, const std::string& rig,
                    std::uint64_t lost_results, bool is_upper_bound) {
  std::string losses;
  const auto add = [&](std::uint64_t count, const char* what) {
    if (count > 0) losses += (losses.empty() ? "" : ", ") + std::to_string(count) + " " + what;
  };
  add(tally.missed - tally.withheld, "captures that never arrived (missed)");
  add(tally.withheld, "captures without room at their sender (withheld)");
  add(tally.damaged, "messages without a whole point cloud (damaged)");
  add(tally.silent, "senders that stopped without goodbye (their withheld captures are unknown)");
  add(lost_results, "results and states of the matcher");
  const std::string of_rig = rig.empty() ? "" : " of rig " + rig;
  if (!losses.empty()) log_warning("{} is incomplete; missing{}: {}", file, of_rig, losses);
  if (const std::uint64_t lost = tally.refused + tally.undelivered; lost > 0)
    log_warning(
        "the matcher did not get {} of {} frames{}{}; they are recorded", lost, tally.received, of_rig,
        is_upper_bound && tally.undelivered > 0 ? " (at most: what it received after its last state is unknown)" : "");
  if (tally.unforwarded_controls > 0)
    log_warning("the senders' last control messages{} did not reach the matcher; its account ends before them", of_rig);
}

}  // namespace

RecordTally& RecordTally::operator+=(const RecordTally& more) noexcept {
  received += more.received;
  damaged += more.damaged;
  too_many_points += more.too_many_points;
  forwarded += more.forwarded;
  refused += more.refused;
  undelivered += more.undelivered;
  missed += more.missed;
  withheld += more.withheld;
  silent += more.silent;
  interleaved += more.interleaved;
  unforwarded_controls += more.unforwarded_controls;
  return *this;
}

void print(const RunTally& tally, const RunObserver::Counts& counts, bool as_json) {
  Json json{{"received", tally.received}, {"recorded", counts.recorded}, {"unrecorded", counts.unrecorded}};
  add_account(json, tally);
  json["lost_results"] = tally.lost_results;
  std::string text = line_of(json);
  for (const RunTally::Rig& rig : tally.rigs) {
    Json of_rig{{"received", rig.received}};
    add_account(of_rig, rig);
    text += "\n  " + rig.name + ": " + line_of(of_rig);
    json["rigs"][rig.name] = of_rig;
  }
  wait_for_log();
  print_last_line(as_json ? json.dump() : text);
}

void warn_of_losses(const std::string& file, const RunTally& tally) {
  if (tally.rigs.empty()) return warn_of_losses(file, tally, "", tally.lost_results, tally.is_upper_bound);
  for (const RunTally::Rig& rig : tally.rigs) warn_of_losses(file, rig, rig.name, 0, tally.is_upper_bound);
  warn_of_losses(file, {}, "", tally.lost_results, false);
}

}  // namespace lbea::tool
