#include "tools/inspect/reports.hpp"

#include "adapters/mcap/salvage.hpp"
#include "tools/shared/recording/recording_file.hpp"
#include "tools/shared/recording/run_audit.hpp"
#include "tools/shared/text/formatted.hpp"

#include <algorithm>
#include <fstream>

namespace lbea::tool {
namespace {

using Json = nlohmann::ordered_json;

unsigned long long number(std::uint64_t value) { return value; }

Json sessions_json(const RunAudit& audit) {
  Json sessions = Json::array();
  for (const auto& [id, session] : audit.sessions)
    sessions.push_back({{"session", hexadecimal(id)},
                        {"frames", session.frames},
                        {"first_id", session.first_id},
                        {"last_id", session.last_id},
                        {"missing", session.missing},
                        {"duplicates", session.duplicates},
                        {"ended", session.ended},
                        {"silent", session.silent}});
  return sessions;
}

Json rigs_json(const RunSettings& settings) {
  Json rigs = Json::array();
  for (const RigSettings& rig : settings.rigs)
    rigs.push_back(
        {{"name", rig.name}, {"T_reference_sensor", rig.T_reference_sensor}, {"clock_offset_ns", rig.clock_offset_ns}});
  return rigs;
}

Json components_json(const RunSettings& settings) {
  Json components = Json::array();
  for (const ComponentSettings& component : settings.components)
    components.push_back({{"name", component.name},
                          {"model_file", component.model_file},
                          {"model_checksum", hexadecimal(component.model_checksum)}});
  return components;
}

Json settings_json(const RunSettings& settings) {
  return {{"program", settings.program},
          {"model_file", settings.model_file},
          {"model_checksum", hexadecimal(settings.model_checksum)},
          {"method", settings.method},
          {"start_ns", settings.start_ns},
          {"trigger_ns", settings.matcher.trigger_ns},
          {"T_reference_sensor", settings.matcher.T_reference_sensor},
          {"rigs", rigs_json(settings)},
          {"components", components_json(settings)}};
}

Json channels_json(const mcap::FileCheck& file) {
  Json channels = Json::array();
  for (const auto& [id, channel] : file.definitions.channels) {
    const auto schema = file.definitions.schemas.find(channel.schema_id);
    const auto count = file.counted.messages_by_channel.find(id);
    channels.push_back({{"topic", channel.topic},
                        {"schema", schema == file.definitions.schemas.end() ? "" : schema->second.name},
                        {"messages", count == file.counted.messages_by_channel.end() ? 0 : count->second}});
  }
  return channels;
}

Json gaps_json(const std::vector<mcap::Gap>& gaps) {
  Json list = Json::array();
  for (const mcap::Gap& gap : gaps) list.push_back({{"begin", gap.begin}, {"end", gap.end}, {"what", gap.what}});
  return list;
}

/// The names and counts of all statuses with this fate whose count is not zero.
Json reasons_json(const wire::Counters& counters, wire::Fate fate) {
  Json reasons = Json::object();
  for (std::size_t i = 0; i < wire::wire_status_count; ++i)
    if (const auto status = static_cast<wire::WireStatus>(i); wire::fate_of(status) == fate && counters.of(status) > 0)
      reasons[std::string(wire::to_string(status))] = counters.of(status);
  return reasons;
}

/// Null without a matcher.
Json matcher_json(const RunAudit& audit) {
  if (!audit.counters) return nullptr;
  const wire::Counters& counters = *audit.counters;
  return {{"captured", counters.captured()},
          {"matched", counters.sum(wire::Fate::matched)},
          {"rejected", counters.sum(wire::Fate::rejected)},
          {"dropped", counters.sum(wire::Fate::dropped)},
          {"rejected_by_reason", reasons_json(counters, wire::Fate::rejected)},
          {"dropped_by_reason", reasons_json(counters, wire::Fate::dropped)},
          {"missed", counters.of(wire::WireStatus::missed)},
          {"withheld", counters.of(wire::WireStatus::withheld)},
          {"silent", counters.silent},
          {"interleaved", counters.interleaved}};
}

Json window_json(const RunAudit& audit) {
  if (!audit.window) return nullptr;
  return {{"triggered", audit.window->triggered},
          {"frames_outside", audit.window->outside},
          {"cut_apart", audit.cut_apart}};
}

Json report(const std::filesystem::path& file, const RunAudit& audit) {
  return {{"file", file.string()},
          {"complete", audit.is_complete()},
          {"flaws", audit.flaws()},
          {"holds_all_that_came", audit.holds_all_that_came()},
          {"intact", audit.file.is_intact()},
          {"closed", audit.file.is_closed},
          {"indexed", audit.file.has_summary},
          {"bytes", audit.file.bytes},
          {"chunks", audit.file.counted.chunks},
          {"messages", audit.file.counted.messages},
          {"frames", audit.frames},
          {"results", audit.results},
          {"states", audit.states},
          {"missing", audit.missing()},
          {"duplicates", audit.duplicates()},
          {"interleaved", audit.interleaved},
          {"unanswered", audit.unanswered},
          {"lost_while_recording", audit.lost},
          {"seconds", static_cast<double>(audit.end_ns - audit.start_ns) * 1e-9},
          {"results_by_status", audit.results_by_status},
          {"matcher", matcher_json(audit)},
          {"window", window_json(audit)},
          {"sessions", sessions_json(audit)},
          {"channels", channels_json(audit.file)},
          {"gaps", gaps_json(audit.file.gaps)},
          {"settings", settings_json(audit.settings)}};
}

std::string place_of(const RigSettings& rig) {
  if (rig.sensor_json.empty() && rig.T_reference_sensor == MatcherConfig{}.T_reference_sensor)
    return ", pose not recorded";
  return formatted(" at %.3f %.3f %.3f", static_cast<double>(rig.T_reference_sensor[3]),
                   static_cast<double>(rig.T_reference_sensor[7]), static_cast<double>(rig.T_reference_sensor[11]));
}

void print_settings(const RunSettings& settings) {
  std::printf("\nrecorded by %s\n  model %s, checksum %s, method %s\n", printable(settings.program).c_str(),
              printable(settings.model_file).c_str(), hexadecimal(settings.model_checksum).c_str(),
              printable(settings.method).c_str());
  for (const ComponentSettings& component : settings.components)
    std::printf("  component %s: model %s, checksum %s\n", printable(component.name).c_str(),
                printable(component.model_file).c_str(), hexadecimal(component.model_checksum).c_str());
  for (const RigSettings& rig : settings.rigs)
    std::printf("  rig %s%s, clock offset %lld ns\n", printable(rig.name).c_str(), place_of(rig).c_str(),
                static_cast<long long>(rig.clock_offset_ns));
}

void print_matcher(const RunAudit& audit) {
  const Json matcher = matcher_json(audit);
  if (matcher.is_null()) return;
  std::printf("\nthe matcher's last counters\n ");
  for (const char* key : {"captured", "matched", "rejected", "dropped"})
    std::printf(" %s %s", key, matcher[key].dump().c_str());
  for (const char* reasons : {"rejected_by_reason", "dropped_by_reason"})
    for (const auto& [reason, count] : matcher[reasons].items())
      std::printf("\n    %-14s %s", reason.c_str(), count.dump().c_str());
  std::printf("\n");
}

void print_sessions(const RunAudit& audit) {
  std::printf("\nsessions\n");
  for (const auto& [id, session] : audit.sessions)
    std::printf("  %s  captures %llu to %llu: frames %llu, missing %llu%s%s\n", hexadecimal(id).c_str(),
                number(session.first_id), number(session.last_id), number(session.frames), number(session.missing),
                session.ended ? ", ended by the sender" : "", session.silent ? ", stopped without goodbye" : "");
}

void print_verdict(const std::filesystem::path& file, const RunAudit& audit) {
  std::printf("%s: %s, %llu bytes\n", file.string().c_str(), audit.is_complete() ? "complete" : "NOT COMPLETE",
              number(audit.file.bytes));
  const auto flaws = audit.flaws();
  if (audit.holds_all_that_came() && !flaws.empty())
    std::printf("  the file is sound and contains everything that was received; but:\n");
  for (const std::string& flaw : flaws) std::printf("  %s\n", printable(flaw).c_str());
  if (audit.window && audit.window->triggered)
    std::printf(
        "  only what happened around the trigger; the counterparts of %llu frames or results at its edges are "
        "outside\n",
        number(audit.cut_apart));
}

void print_text(const std::filesystem::path& file, const RunAudit& audit) {
  print_verdict(file, audit);
  std::printf("\n  frames           %llu in %.3f s\n  results          %llu\n  duplicates       %llu\n",
              number(audit.frames), static_cast<double>(audit.end_ns - audit.start_ns) * 1e-9, number(audit.results),
              number(audit.duplicates()));
  for (const auto& [status, count] : audit.results_by_status)
    std::printf("    %-14s %llu\n", status.c_str(), number(count));
  print_matcher(audit);
  print_sessions(audit);
  std::printf("\nchannels\n");
  for (const Json& channel : channels_json(audit.file))
    std::printf("  %-12s %-20s %llu messages\n", printable(channel["topic"].get<std::string>()).c_str(),
                printable(channel["schema"].get<std::string>()).c_str(),
                number(channel["messages"].get<std::uint64_t>()));
  print_settings(audit.settings);
}

static Json to_json(const std::filesystem::path& fixed, const mcap::Recovery& done) {
  return {{"file", fixed.string()},        {"chunks", done.chunks},
          {"messages", done.messages},     {"undefined_messages", done.undefined_messages},
          {"was_closed", done.was_closed}, {"lost_bytes", done.lost_bytes()},
          {"gaps", gaps_json(done.gaps)}};
}

void print_recovery(const std::filesystem::path& fixed, const mcap::Recovery& done, bool as_json) {
  if (as_json) {
    std::printf("%s\n", pretty(to_json(fixed, done)).c_str());
    return;
  }
  std::printf("%s: %llu messages in %llu chunks recovered\n", fixed.string().c_str(), number(done.messages),
              number(done.chunks));
  for (const mcap::Gap& gap : done.gaps)
    std::printf("  bytes %llu to %llu could not be read: %s\n", number(gap.begin), number(gap.end),
                printable(gap.what).c_str());
  if (done.undefined_messages > 0)
    std::printf("  %llu messages omitted: their channel is not defined\n", number(done.undefined_messages));
}

}  // namespace

bool is_recording(const std::filesystem::path& file) {
  if (file.extension() == ".mcap" || file.extension() == ".partial") return true;
  if (!std::filesystem::is_regular_file(file)) return false;  // opening a FIFO would block
  std::array<char, mcap::magic.size()> front{};
  std::ifstream(file, std::ios::binary).read(front.data(), front.size());
  return std::ranges::equal(std::as_bytes(std::span(front)), std::as_bytes(std::span(mcap::magic)));
}

bool print_recording(const std::filesystem::path& file, bool as_json) {
  const RunAudit audit = audit_run(file);
  if (as_json)
    std::printf("%s\n", pretty(report(file, audit)).c_str());
  else
    print_text(file, audit);
  return audit.is_complete();
}

void recover_recording(const std::filesystem::path& damaged, const std::filesystem::path& fixed, bool as_json) {
  const mcap::FileSource source(damaged);
  std::error_code unknown;
  const std::filesystem::path partial = mcap::partial_name(fixed);
  const bool is_made_of_partial = std::filesystem::equivalent(partial, damaged, unknown);
  std::filesystem::path recovering = fixed;
  recovering += ".recovering";
  mcap::PartialFile sink(fixed, is_made_of_partial ? recovering : partial);
  try {
    print_recovery(fixed, mcap::recover(source, sink, closing_metadata_name), as_json);
  } catch (const Error& error) {
    if (error.status != Status::write_failed) throw;
    throw Error(error.status, fixed.string() + ": " + error.what());
  }
}

}  // namespace lbea::tool
