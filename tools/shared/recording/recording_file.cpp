#include "tools/shared/recording/recording_file.hpp"

#include <lbea/lbea.hpp>

#include <cerrno>
#include <system_error>

namespace lbea::tool {
namespace {

using namespace std::chrono_literals;

constexpr auto stop_interval = 20ms;     // longest delay of DiskSyncer::stop() besides a running sync
constexpr auto report_interval = 100ms;  // between two loss reports in the file

std::string losses_json(const RecorderStatus::Queue& queue) {
  return "{\"no_room\":" + std::to_string(queue.no_room) + ",\"write_failed\":" + std::to_string(queue.write_failed) +
         "}";
}

}  // namespace

void DiskSyncer::run(const std::stop_token& stopped) noexcept {
  std::uint64_t synced = 0;
  auto due = std::chrono::steady_clock::now() + interval_;
  while (!stopped.stop_requested()) {
    std::this_thread::sleep_for(stop_interval);
    if (std::chrono::steady_clock::now() < due || disk_.bytes == synced) continue;
    synced = disk_.bytes;
    if (const int error = sink_.sync(); error != 0) {
      disk_.last_error = error;
      ++disk_.failed_syncs;
    }
    due = std::chrono::steady_clock::now() + interval_;
  }
}

void RepeatedDefinitions::append_when_due(mcap::Buffer& front, bool has_messages) {
  const auto now = Clock::now();
  if (!changed_ && !(has_messages && now >= due_)) return;
  due_ = now + interval_;
  for (const auto& [id, schema] : definitions_.schemas) mcap::append(front, schema);
  for (const auto& [id, channel] : definitions_.channels) mcap::append(front, channel);
}

std::string loss_report_json(const RecorderStatus& status) {
  return "{\"state\":\"" + std::string(to_string(status.phase)) + "\",\"lost_frames\":" + losses_json(status.frames) +
         ",\"lost_notes\":" + losses_json(status.notes) + ",\"failed_syncs\":" + std::to_string(status.failed_syncs) +
         "}";
}

std::string_view loss_report_schema() noexcept {
  return R"({"title":"lbea.Recorder","description":"What the recorder lost so far, written when it changes",)"
         R"("type":"object","properties":{"state":{"type":"string"},)"
         R"("lost_frames":{"$ref":"#/$defs/lost"},"lost_notes":{"$ref":"#/$defs/lost"},)"
         R"("failed_syncs":{"type":"integer"}},"$defs":{"lost":{"type":"object","properties":{)"
         R"("no_room":{"type":"integer"},"write_failed":{"type":"integer"}}}}})";
}

void LossReports::append_when_due(mcap::Buffer& out, const RecorderStatus& status) {
  const auto now = std::chrono::steady_clock::now();
  if (!is_due(now)) return;
  due_ = now + report_interval;
  append_when_changed(out, status);
}

void LossReports::append_when_changed(mcap::Buffer& out, const RecorderStatus& status) {
  std::string report = loss_report_json(status);
  if (report == last_) return;
  const auto time = static_cast<std::uint64_t>(wire::wall_clock_ns());
  mcap::append(out, mcap::Message{channel_, sequence_, time, time, std::as_bytes(std::span(report))});
  appended_ = std::move(report);
}

mcap::Metadata closing_metadata(const RecorderStatus& status) {
  const auto text = [](auto number) { return std::to_string(number); };
  mcap::Metadata closing{std::string(closing_metadata_name),
                         {{"frames_recorded", text(status.frames.recorded)},
                          {"frames_lost_no_room", text(status.frames.no_room)},
                          {"frames_lost_write_failed", text(status.frames.write_failed)},
                          {"notes_recorded", text(status.notes.recorded)},
                          {"notes_lost_no_room", text(status.notes.no_room)},
                          {"notes_lost_write_failed", text(status.notes.write_failed)},
                          {"failed_syncs", text(status.failed_syncs)}}};
  if (!status.window) return closing;
  const auto set = [&](std::string_view key, std::string value) { closing.texts.emplace(key, std::move(value)); };
  set(triggered_key, status.window->triggered ? "yes" : "no");
  set(window_begin_key, text(status.window->begin_ns));
  set(window_end_key, text(status.window->end_ns));
  set(frames_outside_key, text(status.frames.outside));
  return closing;
}

RecordingFile::RecordingFile(mcap::Sink& sink, mcap::Compression compression, const RecordingStart& start,
                             RepeatedDefinitions& definitions, DiskStatus& disk)
    : sink_(sink), writer_(sink, compression), definitions_(definitions), reports_(start.status_channel), disk_(disk) {
  int error = writer_.begin(start.header);
  for (const mcap::Metadata& metadata : start.metadata)
    if (error == 0) error = writer_.metadata(metadata);
  if (error != 0)
    throw Error(Status::write_failed, "the recording cannot be started: " + std::generic_category().message(error) +
                                          "; check the folder and the free space");
  disk_.bytes = writer_.size();
}

/// Runs a step that writes and updates the disk's status.
template <class Step>
bool RecordingFile::run(const Step& step) noexcept {
  int error = 0;
  try {
    error = step();
  } catch (...) { error = ENOMEM; }
  if (error != 0) disk_.last_error = error;
  disk_.bytes = writer_.size();
  return error == 0;
}

bool RecordingFile::write(mcap::Bytes notes, mcap::Bytes frames, const RecorderStatus& status) {
  front_.clear();
  definitions_.append_when_due(front_, !notes.empty() || !frames.empty());
  reports_.append_when_due(front_, status);
  if (front_.empty() && notes.empty() && frames.empty()) return true;
  const std::array<mcap::Bytes, 3> pieces{front_, notes, frames};
  const auto begin = std::chrono::steady_clock::now();
  const bool written = run([&] { return writer_.chunk(pieces); });
  const std::int64_t write_ns = std::chrono::nanoseconds(std::chrono::steady_clock::now() - begin).count();
  if (write_ns > disk_.longest_write_ns) disk_.longest_write_ns = write_ns;
  definitions_.confirm(written);
  reports_.confirm(written);
  return written;
}

bool RecordingFile::write_last_report(const RecorderStatus& status) noexcept {
  return run([&] {
    front_.clear();
    definitions_.append_when_due(front_,
                                 false);  // they may be lost with the last chunk, and the report needs its channel
    reports_.append_when_changed(front_, status);
    const mcap::Bytes piece = front_;
    return front_.empty() ? 0 : writer_.chunk({&piece, 1});
  });
}

bool RecordingFile::write(const mcap::Metadata& metadata) noexcept {
  return run([&] { return writer_.metadata(metadata); });
}

bool RecordingFile::close(const RecorderStatus& status) noexcept {
  return run([&] {
    int error = writer_.metadata(closing_metadata(status));
    if (error == 0) error = writer_.finish();
    if (error == 0) error = sink_.commit();
    return error;
  });
}

}  // namespace lbea::tool
