#include "tools/monitor/feeds/health.hpp"

#include <nlohmann/json.hpp>

#include <algorithm>
#include <cmath>

namespace lbea::tool {
namespace {

using namespace std::chrono_literals;

constexpr auto size_window = 10s;  // of the write rate

std::size_t bin_of(double ms) {
  if (ms <= Health::first_edge_ms) return 0;
  const double bin = std::ceil(2 * std::log2(ms / Health::first_edge_ms));
  return std::min(static_cast<std::size_t>(bin), Health::bins - 1);
}

/// Upper edge of the bin that contains the quantile; 0 for an empty histogram.
double quantile_ms(const std::array<std::uint64_t, Health::bins>& histogram, double share) {
  std::uint64_t total = 0, below = 0;
  for (const std::uint64_t count : histogram) total += count;
  for (std::size_t bin = 0; bin < Health::bins; ++bin) {
    below += histogram[bin];
    if (total > 0 && static_cast<double>(below) >= share * static_cast<double>(total))
      return Health::first_edge_ms * std::exp2(static_cast<double>(bin) / 2);
  }
  return 0;
}

nlohmann::json age_ms(Health::Clock::time_point then, Health::Clock::time_point now) {
  if (then == Health::Clock::time_point{}) return nullptr;
  return std::chrono::duration_cast<std::chrono::milliseconds>(now - then).count();
}

nlohmann::json json_of(const wire::Counters& counters) {
  nlohmann::json reasons = nlohmann::json::object();
  for (std::size_t i = 0; i < wire::wire_status_count; ++i) {
    const auto status = static_cast<wire::WireStatus>(i);
    const bool is_loss = wire::fate_of(status) == wire::Fate::rejected || wire::fate_of(status) == wire::Fate::dropped;
    if (is_loss && counters.by_status[i] > 0) reasons[std::string(wire::to_string(status))] = counters.by_status[i];
  }
  return {{"received", counters.received},
          {"matched", counters.sum(wire::Fate::matched)},
          {"rejected", counters.sum(wire::Fate::rejected)},
          {"dropped", counters.sum(wire::Fate::dropped)},
          {"missed", counters.missed},
          {"duplicates", counters.duplicates},
          {"interleaved", counters.interleaved},
          {"recorded", counters.recorded},
          {"unrecorded", counters.unrecorded},
          {"reasons", reasons}};
}

}  // namespace

void FrameRate::add(Clock::time_point now) {
  ++count_;
  if (now - begin_ < 1s) return;
  const double seconds = std::chrono::duration<double>(now - begin_).count();
  rate_ = seconds < 3 ? static_cast<double>(count_) / seconds : 0;
  begin_ = now;
  count_ = 0;
}

double FrameRate::per_second(Clock::time_point now) const { return now - begin_ < 3s ? rate_ : 0; }

void Health::turn_windows(Clock::time_point now) {
  if (now - window_begin_ < window) return;
  previous_ = now - window_begin_ < 2 * window ? current_ : Histogram{};
  current_ = {};
  window_begin_ = now;
}

void Health::count_lost(std::uint64_t sequence) {
  // A smaller number means that lbea-serve was restarted.
  if (sequence_ && sequence > *sequence_ + 1) lost_ += sequence - *sequence_ - 1;
  sequence_ = sequence;
}

void Health::add_other(const wire::WireResult& result) { count_lost(result.sequence); }

void Health::add(const wire::WireResult& result, Clock::time_point now) {
  count_lost(result.sequence);
  last_message_ = now;
  counters_ = result.counters;
  if (result.status == wire::WireStatus::end_of_stream) return;
  last_frame_ = now;
  turn_windows(now);
  ++current_[bin_of(static_cast<double>(result.elapsed_ns.total) * 1e-6)];
  rate_.add(now);
  for (const wire::WireRigFrame& frame : result.rigs) {
    Rig& rig = rigs_[frame.rig];
    rig.latest = frame;
    rig.last_frame = now;
    rig.rate.add(now);
  }
}

void Health::add(const wire::WireState& state, Clock::time_point now) {
  if (state_ && state_->start_ns != state.start_ns) last_frame_ = {};
  count_lost(state.sequence);
  last_message_ = now;
  counters_ = state.counters;
  state_ = state;
  if (state.recording)
    add_size(*state.recording, now);
  else
    sizes_.clear();
}

void Health::add_size(const wire::WireRecording& recording, Clock::time_point now) {
  if (!sizes_.empty() && recording.bytes < sizes_.back().bytes) sizes_.clear();  // a new file
  sizes_.push_back({now, recording.bytes});
  while (now - sizes_.front().time > size_window) sizes_.pop_front();
}

nlohmann::json Health::recording_report() const {
  const wire::WireRecording& recording = *state_->recording;
  const double seconds = std::chrono::duration<double>(sizes_.back().time - sizes_.front().time).count();
  const double rate = seconds > 0 ? static_cast<double>(sizes_.back().bytes - sizes_.front().bytes) / seconds : 0;
  nlohmann::json report{{"phase", wire::to_string(recording.phase)}, {"bytes", recording.bytes}, {"bytes_per_s", rate}};
  report["free_bytes"] = report["seconds_left"] = nullptr;
  if (recording.free_bytes == wire::WireRecording::unknown) return report;
  report["free_bytes"] = recording.free_bytes;
  if (rate > 0) report["seconds_left"] = static_cast<double>(recording.free_bytes) / rate;
  return report;
}

/// In the order of the state; those that have sent nothing too.
nlohmann::json Health::rig_reports(Clock::time_point now) const {
  nlohmann::json reports = nlohmann::json::array();
  for (const wire::WireRig& described : state_ ? state_->rigs : std::vector<wire::WireRig>{}) {
    const auto rig = rigs_.find(described.name);
    nlohmann::json report{{"name", described.name},
                          {"counters", json_of(described.counters)},
                          {"clock_offset_ms", static_cast<double>(described.clock_offset_ns) * 1e-6},
                          {"rate", 0.0},
                          {"last_frame_ms", nullptr}};
    if (rig != rigs_.end()) {
      const wire::WireRigFrame& frame = rig->second.latest;
      report["rate"] = rig->second.rate.per_second(now);
      report["last_frame_ms"] = age_ms(rig->second.last_frame, now);
      report["coverage"] = frame.coverage;
      report["is_used"] = frame.is_used;
      report["clock_correction_ms"] = static_cast<double>(frame.clock_correction_ns) * 1e-6;
      report["verdict"] = wire::to_string(frame.verdict);
      report["pose_turn"] = frame.pose_turn;  // NaN becomes null
      report["pose_shift"] = frame.pose_shift;
    }
    reports.push_back(std::move(report));
  }
  return reports;
}

nlohmann::json Health::report(Clock::time_point now) const {
  Histogram histogram = previous_;
  for (std::size_t bin = 0; bin < bins; ++bin) histogram[bin] += current_[bin];
  nlohmann::json report{{"counters", json_of(counters_)},
                        {"results_lost_here", lost_},
                        {"unreadable_here", unreadable_},
                        {"heard_ms", age_ms(last_message_, now)},
                        {"last_frame_ms", age_ms(last_frame_, now)},
                        {"rate", rate_.per_second(now)},
                        {"latency",
                         {{"bins", histogram},
                          {"first_edge_ms", first_edge_ms},
                          {"p50_ms", quantile_ms(histogram, 0.5)},
                          {"p99_ms", quantile_ms(histogram, 0.99)}}}};
  if (state_)
    report["server"] = {{"version", state_->version},
                        {"method", state_->method},
                        {"queue_used", state_->queue_used},
                        {"queue_slots", state_->queue_slots},
                        {"start_ns", std::to_string(state_->start_ns)}};
  if (state_ && state_->recording) report["server"]["recording"] = recording_report();
  if (state_ && !state_->rigs.empty()) report["rigs"] = rig_reports(now);
  return report;
}

}  // namespace lbea::tool
