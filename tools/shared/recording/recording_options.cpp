#include "tools/shared/recording/recording_options.hpp"

#include "adapters/files/file_names.hpp"
#include "runtime/src/model/mapped_file.hpp"
#include "tools/shared/intake/log.hpp"
#include "tools/shared/system/local_time.hpp"
#include "tools/shared/system/trigger_signal.hpp"
#include "tools/shared/text/formatted.hpp"

#include <cstdlib>
#include <ctime>
#include <system_error>

namespace lbea::tool {
namespace {

constexpr auto log_interval = std::chrono::seconds(1);
constexpr auto disk_interval = std::chrono::milliseconds(500);
constexpr std::size_t megabyte = std::size_t{1} << 20;
constexpr double most_window_s = 86'400;
constexpr std::int64_t least_clock_step_ns = 100'000'000;

const std::map<std::string, mcap::Compression> compression_names{
    {"none", mcap::Compression::none}, {"lz4", mcap::Compression::lz4}, {"zstd", mcap::Compression::zstd}};

std::optional<std::chrono::nanoseconds> seconds(std::string_view text) {
  const auto value = parsed<double>(text);
  if (!value || !(*value >= 0 && *value <= most_window_s)) return std::nullopt;
  return std::chrono::nanoseconds(static_cast<std::int64_t>(*value * 1e9));
}

RecordWindow parse_window(const std::string& text) {
  const auto colon = text.find(':');
  const std::string_view view = text;
  if (colon != std::string::npos) {
    const auto before = seconds(view.substr(0, colon)), after = seconds(view.substr(colon + 1));
    if (before && after) return {*before, *after};
  }
  throw Error(Status::bad_config, "--record-window \"" + text + "\": not BEFORE:AFTER in seconds; write e.g. 0.5:2");
}

/// Nothing without a window.
std::optional<RecordWindow> window_of(const RecordingOptions& options) {
  if (options.window.empty()) return std::nullopt;
  if (!has_trigger_signal() && !options.trigger_ns)
    throw Error(Status::bad_config, "--record-window: nothing can trigger the recording; give --trigger-ns as well");
  return parse_window(options.window);
}

void check_memory(std::size_t bytes) {
  const std::uint64_t installed = memory_of_machine();
  if (bytes > installed / 2)
    throw Error(Status::bad_config,
                fmt::format("--record-memory {} MB is more than half of this machine's {} MB; request less",
                            bytes / megabyte, installed / megabyte));
}

/// Empty when `pattern` is not valid or gives an empty name.
std::string name_at(const std::string& pattern, std::time_t time) {
  for (auto at = pattern.find('%'); at != std::string::npos; at = pattern.find('%', at + 2))
    if (at + 1 == pattern.size() || time_conversions().find(pattern[at + 1]) == std::string_view::npos) return {};
  const std::tm local = local_time(time);
  std::array<char, 4096> name{};  // the longest path
  return {name.data(), std::strftime(name.data(), name.size(), pattern.c_str(), &local)};
}

std::string reason(int error) { return error == 0 ? "" : ": " + std::generic_category().message(error); }

}  // namespace

void add_recording_options(Tool& tool, RecordingOptions& options) {
  tool.add_option("--record-memory", options.memory_mb, "memory for frames that wait for the disk, in MB")
      ->check(in_range(std::size_t{1}, std::size_t{1} << 24));
  tool.add_choice("--record-compression", options.config.compression, compression_names,
                  "none: as fast as the disk; lz4, zstd: smaller files, but slower");
  tool.add_option("--record-window", options.window,
                  std::string("BEFORE:AFTER in seconds: record only what happens around a trigger, which is ") +
                      trigger_signal_text() + "the first frame captured at --trigger-ns or later");
}

Check recording_name() {
  const std::time_t start = std::time(nullptr);
  const auto replace = [start](std::string& name) -> std::string {
    if (name.empty()) return "is empty; is a variable of the shell unset?";
    std::string named = name_at(name, start);
    if (named.empty())
      return "\"" + name +
             "\" is not a valid file name in strftime's notation; write e.g. %Y-%m-%d_%H-%M-%S.mcap, and %% for a "
             "percent sign";
    name = std::move(named);
    return {};
  };
  return Check(replace, "");
}

void check_recording(const RecordingOptions& options) {
  check_memory(options.memory_mb * megabyte);
  static_cast<void>(window_of(options));
  const mcap::PartialFile probe(io::path_of(options.file));
}

std::unique_ptr<RunRecorder> begin_recording(const RecordingOptions& options, RunSettings settings) {
  if (options.file.empty()) return nullptr;
  RecorderConfig config = options.config;
  config.frame_ring_bytes = options.memory_mb * megabyte;
  check_memory(config.frame_ring_bytes);
  config.window = window_of(options);
  settings.record_window = options.window;
  auto recorder = std::make_unique<RunRecorder>(io::path_of(options.file), config, settings);
  if (config.window && options.trigger_ns) recorder->trigger_at(*options.trigger_ns);
  log_info("recording to {}{}", options.file, config.window ? ", waiting for the trigger" : "");
  return recorder;
}

void RecordingLog::forward_trigger() {
  if (!take_trigger_signal()) return;
  if (recorder_ != nullptr && recorder_->status().window)
    recorder_->trigger_now();
  else
    log_warning("SIGUSR1: there is no --record-window to trigger; the signal is ignored");
}

void RecordingLog::log_clock_step() {
  const std::int64_t step_ns = wire::system_clock_ns() - wire::wall_clock_ns();
  if (std::abs(step_ns - clock_step_ns_) < least_clock_step_ns) return;
  log_warning(
      "the system's clock stepped by {:.1f} s; the times of results and recordings go on without the step until this "
      "program is restarted",
      1e-9 * static_cast<double>(step_ns - clock_step_ns_));
  clock_step_ns_ = step_ns;
}

void RecordingLog::poll() {
  forward_trigger();
  log_clock_step();
  if (recorder_ == nullptr) return;
  log_changes(recorder_->status());
  if (const auto now = Clock::now(); now - last_disk_check_ >= disk_interval) {
    recorder_->update_free_space();
    last_disk_check_ = now;
  }
}

void RecordingLog::log_changes(const RecorderStatus& status) {
  const auto now = Clock::now();
  const std::uint64_t lost = this->lost();
  if ((lost != lost_ || status.failed_syncs != failed_syncs_) && now - last_loss_ >= log_interval) {
    log_error(
        "recording: LOST so far: {} frames and {} results and states because memory was full, {} and {} because a "
        "write failed{}",
        status.frames.no_room, status.notes.no_room, status.frames.write_failed, status.notes.write_failed,
        reason(status.last_error));
    last_loss_ = now;
    lost_ = lost;
    failed_syncs_ = status.failed_syncs;
  }
  const bool is_slow = status.phase == wire::RecordingPhase::recording && status.ring_used > status.ring_bytes / 4 * 3;
  if (is_slow && now - last_warning_ >= log_interval) {
    log_warning("recording: the disk is slow; {} MB of {} MB are waiting to be written", status.ring_used / megabyte,
                status.ring_bytes / megabyte);
    last_warning_ = now;
  }
  if (status.phase != phase_ && status.phase == wire::RecordingPhase::recording) log_info("recording: triggered");
  if (status.phase != phase_ && status.phase == wire::RecordingPhase::finished) log_end(status);
  phase_ = status.phase;
}

std::uint64_t RecordingLog::lost() const { return recorder_->counts().unrecorded; }

void RecordingLog::log_end(const RecorderStatus& status) {
  if (status.has_ended_untriggered())
    log_error("recording: THERE WAS NO TRIGGER: none of {} frames was recorded, {} is empty", status.frames.outside,
              file_);
  else if (status.is_sound() && lost() == 0)
    log_info("recording: {} is complete", file_);
  else
    log_error(
        "recording: {} is closed and NOT complete: {} frames, results and states are lost, {} syncs to the disk "
        "failed{}",
        file_, lost(), status.failed_syncs, reason(status.last_error));
}

bool RecordingLog::finish() {
  if (recorder_ == nullptr) return true;
  const RecorderStatus status = recorder_->finish();
  last_loss_ = {};
  log_changes(status);
  if (status.phase == wire::RecordingPhase::failed)
    log_error("recording: {} could not be closed{}; the recorded part is in {}, see lbea-inspect --recover", file_,
              reason(status.last_error), mcap::partial_name(io::path_of(file_)).string());
  log_info("recorded {} frames and {} results and states, {} MB; longest write {} ms, peak memory use {} %",
           status.frames.recorded, status.notes.recorded, status.bytes / megabyte, status.longest_write_ns / 1'000'000,
           100 * status.ring_peak / std::max<std::size_t>(status.ring_bytes, 1));
  return status.is_sound() && lost() == 0;
}

}  // namespace lbea::tool
