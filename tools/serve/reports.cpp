#include "tools/serve/reports.hpp"

#include "adapters/http/metrics.hpp"
#include "tools/shared/intake/log.hpp"
#include "tools/shared/system/process.hpp"

#include <nlohmann/json.hpp>

#include <algorithm>
#include <cmath>

namespace lbea::tool {
namespace {

void write_frames(http::MetricsText& page, const wire::Counters& counters) {
  const auto counter = [&](const char* name, const char* meaning, std::uint64_t value, const char* type = "counter") {
    page.metric(name, type, meaning).value(value);
  };
  counter("lbea_frames_captured_total", "Captures, by the senders' ids and control messages", counters.captured());
  counter("lbea_frames_received_total", "Frames that arrived, whatever their status", counters.received);
  page.metric("lbea_frames_total", "counter", "Captures by status; the sum is lbea_frames_captured_total");
  for (std::size_t i = 0; i < wire::wire_status_count; ++i) {
    const auto status = static_cast<wire::WireStatus>(i);
    if (wire::fate_of(status) == wire::Fate::not_a_capture) continue;
    page.value(counters.of(status), http::MetricsText::label("fate", wire::to_string(wire::fate_of(status))) + "," +
                                        http::MetricsText::label("status", wire::to_string(status)));
  }
  counter("lbea_frames_on_the_way", "Frames received and without a status yet", counters.on_the_way(), "gauge");
  counter("lbea_frames_reordered_total", "Frames that arrived after one with a higher id", counters.reordered);
  counter("lbea_results_unannounced_total", "Refused, dropped or missed frames without a result of their own",
          counters.unannounced);
  counter("lbea_sender_sessions_total", "Sender sessions", counters.sessions);
  counter("lbea_frames_interleaved_total", "Returns to a sender while the test of another one was running",
          counters.interleaved);
  counter("lbea_senders_silent", "Senders without a message for seconds and without a goodbye", counters.silent,
          "gauge");
  counter("lbea_ends_of_stream_total", "Ends of stream that senders announced",
          counters.of(wire::WireStatus::end_of_stream));
  counter("lbea_recorded_frames_total", "Frames in the recording's file", counters.recorded);
  counter("lbea_unrecorded_total", "Frames and results missing from the recording", counters.unrecorded);
}

void write_rigs(http::MetricsText& page, const std::vector<wire::WireRig>& rigs) {
  if (rigs.empty()) return;
  page.metric("lbea_rig_frames_total", "counter", "Captures of each rig");
  for (const wire::WireRig& rig : rigs)
    for (const auto fate : {wire::Fate::matched, wire::Fate::rejected, wire::Fate::dropped})
      page.value(rig.counters.sum(fate), http::MetricsText::label("rig", rig.name) + "," +
                                             http::MetricsText::label("fate", wire::to_string(fate)));
}

void write_peers(http::MetricsText& page, const Pipeline& pipeline) {
  const wire::PeerCounts frames = pipeline.frame_peers(), results = pipeline.result_peers();
  const std::string at_frames = http::MetricsText::label("endpoint", "frames"),
                    at_results = http::MetricsText::label("endpoint", "results");
  const auto both = [&](std::uint64_t wire::PeerCounts::*count, const std::string& more = {}) {
    page.value(frames.*count, at_frames + more).value(results.*count, at_results + more);
  };
  page.metric("lbea_connections", "gauge", "Open connections, including unknown ones");
  both(&wire::PeerCounts::connections);
  page.metric("lbea_peers", "gauge", "Connections that are admitted");
  both(&wire::PeerCounts::peers);
  page.metric("lbea_peers_admitted_total", "counter", "Connections that were ever admitted");
  both(&wire::PeerCounts::admitted);
  page.metric("lbea_peers_refused_total", "counter", "Connections that were refused");
  both(&wire::PeerCounts::unknown, "," + http::MetricsText::label("reason", "unknown"));
  both(&wire::PeerCounts::excess, "," + http::MetricsText::label("reason", "excess"));
  both(&wire::PeerCounts::malformed, "," + http::MetricsText::label("reason", "malformed"));
  both(&wire::PeerCounts::crowded, "," + http::MetricsText::label("reason", "crowded"));
  page.metric("lbea_peers_cut_off_total", "counter", "Admitted connections that were ended: their peers broke a limit");
  both(&wire::PeerCounts::offending);
}

std::string labels_of(const wire::ModelSummary& model, const std::string& method) {
  return http::MetricsText::label("file", model.file) + "," +
         http::MetricsText::label("checksum", std::to_string(model.checksum)) + "," +
         http::MetricsText::label("method", method);
}

void write_pipeline(http::MetricsText& page, const Pipeline& pipeline) {
  const wire::WireState& about = pipeline.description();
  page.metric("lbea_build_info", "gauge", "This program")
      .value(std::uint64_t{1}, http::MetricsText::label("version", about.version))
      .metric("lbea_model_info", "gauge", "The model")
      .value(std::uint64_t{1}, labels_of(about.model, about.method));
  for (std::size_t i = 1; i < about.components.size(); ++i)
    page.value(std::uint64_t{1}, labels_of(about.components[i].model, about.method));
  page.metric("lbea_start_time_seconds", "gauge", "Time of readiness, in s since 1970")
      .value(static_cast<double>(about.start_ns) * 1e-9)
      .metric("lbea_queue_slots", "gauge", "Frames that may wait for the matcher")
      .value(std::uint64_t{about.queue_slots})
      .metric("lbea_queue_used", "gauge", "Frames that wait for the matcher")
      .value(std::uint64_t{pipeline.queue_used()});
  const LatencyHistogram& match = pipeline.match_times();
  page.histogram("lbea_match_seconds", "Time in the matcher", LatencyHistogram::bounds_s, match.counts(),
                 match.sum_s());
  const LatencyHistogram& total = pipeline.total_times();
  page.histogram("lbea_frame_seconds", "From receiving a frame to publishing its result", LatencyHistogram::bounds_s,
                 total.counts(), total.sum_s());
}

/// Of the latest matched frame while its sender goes on; otherwise they would look like those of the present.
std::vector<wire::WireChannel> present_channels(const Pipeline& pipeline, std::size_t component) {
  const auto [session, channels] = pipeline.latest_channels(component);
  const std::vector<wire::WireSender> senders = pipeline.senders();
  const auto sender = std::ranges::find(senders, session, &wire::WireSender::session);
  const bool goes_on = sender == senders.end() || sender->condition == wire::SenderCondition::active;
  return goes_on ? channels : std::vector<wire::WireChannel>();
}

void write_channels(http::MetricsText& page, const Pipeline& pipeline) {
  const std::vector<wire::WireComponent>& components = pipeline.description().components;
  std::vector<std::pair<std::string, wire::WireChannel>> channels;  // with further labels
  for (std::size_t i = 0; i < std::max<std::size_t>(components.size(), 1); ++i)
    for (wire::WireChannel& channel : present_channels(pipeline, i))
      channels.emplace_back(components.empty() ? "" : "," + http::MetricsText::label("component", components[i].name),
                            std::move(channel));
  if (channels.empty()) return;
  const auto write = [&](const char* name, const char* help, float ChannelValue::*number) {
    page.metric(name, "gauge", help);
    for (const auto& [labels, channel] : channels)
      if (!std::isnan(channel.*number))
        page.value(channel.*number, http::MetricsText::label("name", channel.name) + "," +
                                        http::MetricsText::label("unit", channel.unit) + labels);
  };
  write("lbea_channel", "Quantities of interest of the latest matched frame", &ChannelValue::value);
  write("lbea_channel_bound_90", "90 % of the true values differ from lbea_channel by less", &ChannelValue::bound_90);
}

void write_process(http::MetricsText& page) {
  const ProcessUse use = process_use();
  page.metric("lbea_log_lines_lost_total", "counter", "Lines of the log that nobody read or that could not be written")
      .value(lost_log_lines());
  page.metric("process_resident_memory_bytes", "gauge", "Memory in use")
      .value(use.resident_bytes)
      .metric("process_open_fds", "gauge", "Open descriptors")
      .value(use.descriptors);
}

template <class Visit>
void for_each_status(wire::Fate fate, Visit visit) {
  for (std::size_t i = 0; i < wire::wire_status_count; ++i) {
    if (const auto status = static_cast<wire::WireStatus>(i); wire::fate_of(status) == fate) visit(status);
  }
}

std::string reasons(const wire::Counters& counters, wire::Fate fate) {
  std::string text;
  for_each_status(fate, [&](wire::WireStatus status) {
    if (counters.of(status) == 0) return;
    text +=
        (text.empty() ? " (" : ", ") + std::string(wire::to_string(status)) + " " + std::to_string(counters.of(status));
  });
  return std::to_string(counters.sum(fate)) + text + (text.empty() ? "" : ")");
}

std::string silence(const wire::Counters& counters) {
  if (counters.silent == 0) return {};
  return " (" + std::to_string(counters.silent) + " gone without goodbye: their withheld captures are unknown)";
}

std::string interleaving(const wire::Counters& counters) {
  if (counters.interleaved == 0) return {};
  return " WHOSE FRAMES ALTERNATE (" + std::to_string(counters.interleaved) + " returns)";
}

std::string recording_text(const wire::Counters& counters) {
  if (counters.recorded == 0 && counters.unrecorded == 0) return {};
  return "; recorded " + std::to_string(counters.recorded) + ", NOT recorded " + std::to_string(counters.unrecorded);
}

nlohmann::ordered_json by_reason(const wire::Counters& counters, wire::Fate fate) {
  nlohmann::ordered_json json = nlohmann::ordered_json::object();
  for_each_status(fate,
                  [&](wire::WireStatus status) { json[std::string(wire::to_string(status))] = counters.of(status); });
  return json;
}

std::string line_of(const wire::Counters& counters) {
  return "captured " + std::to_string(counters.captured()) + (counters.adds_up() ? " = " : " IS NOT ") + "matched " +
         reasons(counters, wire::Fate::matched) + " + rejected " + reasons(counters, wire::Fate::rejected) +
         " + dropped " + reasons(counters, wire::Fate::dropped) + "; received " + std::to_string(counters.received) +
         ", reordered " + std::to_string(counters.reordered) + ", sessions " + std::to_string(counters.sessions) +
         interleaving(counters) + silence(counters) + recording_text(counters);
}

nlohmann::ordered_json json_of(const wire::Counters& counters) {
  // Not a null value that becomes an object: its destructor fails when memory is exhausted.
  nlohmann::ordered_json json = nlohmann::ordered_json::object();
  json["captured"] = counters.captured();
  json["received"] = counters.received;
  json["matched"] = counters.sum(wire::Fate::matched);
  json["rejected"] = counters.sum(wire::Fate::rejected);
  json["dropped"] = counters.sum(wire::Fate::dropped);
  json["matched_by_status"] = by_reason(counters, wire::Fate::matched);
  json["rejected_by_reason"] = by_reason(counters, wire::Fate::rejected);
  json["dropped_by_reason"] = by_reason(counters, wire::Fate::dropped);
  json["missed"] = counters.missed;
  json["duplicates"] = counters.duplicates;
  json["reordered"] = counters.reordered;
  json["sessions"] = counters.sessions;
  json["interleaved"] = counters.interleaved;
  json["silent"] = counters.silent;
  json["ends_of_stream"] = counters.of(wire::WireStatus::end_of_stream);
  json["unannounced"] = counters.unannounced;
  json["recorded"] = counters.recorded;
  json["unrecorded"] = counters.unrecorded;
  json["adds_up"] = counters.adds_up();
  return json;
}

}  // namespace

std::string tally_line(const wire::Counters& counters, std::span<const wire::WireRig> rigs) {
  std::string text = line_of(counters);
  for (const wire::WireRig& rig : rigs) text += "\n  " + rig.name + ": " + line_of(rig.counters);
  return text;
}

std::string tally_json(const wire::Counters& counters, std::span<const wire::WireRig> rigs) {
  nlohmann::ordered_json json = json_of(counters);
  for (const wire::WireRig& rig : rigs) json["rigs"][rig.name] = json_of(rig.counters);
  return json.dump();
}

bool is_complete(const wire::Counters& counters) {
  return counters.adds_up() && counters.sum(wire::Fate::dropped) == 0 && counters.silent == 0 &&
         counters.interleaved == 0 && counters.unrecorded == 0;
}

std::string metrics_page(const Pipeline& pipeline) {
  http::MetricsText page;
  write_frames(page, pipeline.counters());
  write_rigs(page, pipeline.rigs());
  write_peers(page, pipeline);
  write_pipeline(page, pipeline);
  write_channels(page, pipeline);
  write_process(page);
  return page.text();
}

}  // namespace lbea::tool
