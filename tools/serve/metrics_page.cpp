#include "tools/serve/metrics_page.hpp"

#include "adapters/http/metrics.hpp"

#include <filesystem>
#include <fstream>

#include <unistd.h>

namespace lbea::tool {
namespace {

std::string_view name_of(wire::Fate fate) {
  switch (fate) {
    case wire::Fate::matched:
      return "matched";
    case wire::Fate::rejected:
      return "rejected";
    case wire::Fate::dropped:
      return "dropped";
    case wire::Fate::not_a_capture:
      break;
  }
  return "not_a_capture";
}

void write_frames(http::MetricsText& page, const wire::Counters& counters) {
  page.metric("lbea_frames_captured_total", "counter", "Captures, as far as the senders' ids and words tell")
      .value(counters.captured())
      .metric("lbea_frames_received_total", "counter", "Frames that arrived, whatever became of them")
      .value(counters.received)
      .metric("lbea_frames_total", "counter", "Captures by what became of them; the sum is lbea_frames_captured_total");
  for (std::size_t i = 0; i < wire::wire_status_count; ++i) {
    const auto status = static_cast<wire::WireStatus>(i);
    if (wire::fate_of(status) == wire::Fate::not_a_capture) continue;
    page.value(counters.of(status), http::MetricsText::label("fate", name_of(wire::fate_of(status))) + "," +
                                        http::MetricsText::label("status", wire::to_string(status)));
  }
  page.metric("lbea_frames_on_the_way", "gauge", "Frames received and not yet at an end")
      .value(counters.on_the_way())
      .metric("lbea_frames_reordered_total", "counter", "Frames that came after one with a higher id")
      .value(counters.reordered)
      .metric("lbea_results_unannounced_total", "counter",
              "Refused, dropped or missed frames without a result of their own")
      .value(counters.unannounced)
      .metric("lbea_sender_sessions_total", "counter", "Starts of senders")
      .value(counters.sessions)
      .metric("lbea_senders_silent", "gauge", "Senders that neither said goodbye nor anything else for seconds")
      .value(counters.silent)
      .metric("lbea_ends_of_stream_total", "counter", "Tests that senders called over")
      .value(counters.of(wire::WireStatus::end_of_stream))
      .metric("lbea_recorded_frames_total", "counter", "Frames in the recording's file")
      .value(counters.recorded)
      .metric("lbea_unrecorded_total", "counter", "Frames and results that a recording was to hold and does not")
      .value(counters.unrecorded);
}

void write_peers(http::MetricsText& page, const Pipeline& pipeline) {
  const wire::PeerCounts frames = pipeline.frame_peers(), results = pipeline.result_peers();
  const std::string at_frames = http::MetricsText::label("endpoint", "frames"),
                    at_results = http::MetricsText::label("endpoint", "results");
  const auto both = [&](std::uint64_t wire::PeerCounts::*count, const std::string& more = {}) {
    page.value(frames.*count, at_frames + more).value(results.*count, at_results + more);
  };
  page.metric("lbea_connections", "gauge", "Open connections, strangers included");
  both(&wire::PeerCounts::connections);
  page.metric("lbea_peers", "gauge", "Connections that were admitted");
  both(&wire::PeerCounts::peers);
  page.metric("lbea_peers_admitted_total", "counter", "Connections that were ever admitted");
  both(&wire::PeerCounts::admitted);
  page.metric("lbea_peers_refused_total", "counter", "Connections that were turned away");
  both(&wire::PeerCounts::unknown, "," + http::MetricsText::label("reason", "unknown"));
  both(&wire::PeerCounts::excess, "," + http::MetricsText::label("reason", "excess"));
  both(&wire::PeerCounts::malformed, "," + http::MetricsText::label("reason", "malformed"));
}

void write_pipeline(http::MetricsText& page, const Pipeline& pipeline) {
  const wire::WireState& about = pipeline.description();
  page.metric("lbea_build_info", "gauge", "This program")
      .value(std::uint64_t{1}, http::MetricsText::label("version", about.version))
      .metric("lbea_model_info", "gauge", "The model it matches with")
      .value(std::uint64_t{1}, http::MetricsText::label("file", about.model.file) + "," +
                                   http::MetricsText::label("checksum", std::to_string(about.model.checksum)) + "," +
                                   http::MetricsText::label("method", about.method))
      .metric("lbea_start_time_seconds", "gauge", "When it became ready, in s since 1970")
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

void write_process(http::MetricsText& page) {
  std::uint64_t pages = 0, resident = 0, descriptors = 0;
  std::ifstream("/proc/self/statm") >> pages >> resident;
  std::error_code ignored;
  for (auto entry = std::filesystem::directory_iterator("/proc/self/fd", ignored);
       entry != std::filesystem::directory_iterator(); entry.increment(ignored))
    ++descriptors;
  page.metric("process_resident_memory_bytes", "gauge", "Memory in use")
      .value(resident * static_cast<std::uint64_t>(::sysconf(_SC_PAGESIZE)))
      .metric("process_open_fds", "gauge", "Open descriptors")
      .value(descriptors);
}

}  // namespace

std::string metrics_page(const Pipeline& pipeline) {
  http::MetricsText page;
  write_frames(page, pipeline.counters());
  write_peers(page, pipeline);
  write_pipeline(page, pipeline);
  write_process(page);
  return page.text();
}

}  // namespace lbea::tool
