#include "adapters/mcap/recorder_account.hpp"

#include "adapters/mcap/wall_clock.hpp"

namespace lbea::mcap {
namespace {

constexpr std::chrono::milliseconds account_interval{100};  // between two accounts in the file

std::string lane_json(const RecorderStatus::Lane& lane) {
  return "{\"no_room\":" + std::to_string(lane.no_room) + ",\"write_failed\":" + std::to_string(lane.write_failed) +
         "}";
}

}  // namespace

std::string account_json(const RecorderStatus& status) {
  return "{\"state\":\"" + std::string(to_string(status.state)) + "\",\"lost_frames\":" + lane_json(status.frames) +
         ",\"lost_notes\":" + lane_json(status.notes) + ",\"failed_syncs\":" + std::to_string(status.failed_syncs) +
         "}";
}

std::string_view account_schema() noexcept {
  return R"({"title":"lbea.Recorder","description":"What the recorder lost so far, written when it changes",)"
         R"("type":"object","properties":{"state":{"type":"string"},)"
         R"("lost_frames":{"$ref":"#/$defs/lost"},"lost_notes":{"$ref":"#/$defs/lost"},)"
         R"("failed_syncs":{"type":"integer"}},"$defs":{"lost":{"type":"object","properties":{)"
         R"("no_room":{"type":"integer"},"write_failed":{"type":"integer"}}}}})";
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
  const auto note = [&](std::string_view key, std::string value) { closing.texts.emplace(key, std::move(value)); };
  note(triggered_key, status.window->triggered ? "yes" : "no");
  note(window_begin_key, text(status.window->begin_ns));
  note(window_end_key, text(status.window->end_ns));
  note(frames_outside_key, text(status.frames.outside));
  return closing;
}

void AccountMessages::append_when_due(mcap::Buffer& out, const RecorderStatus& status) {
  const auto now = std::chrono::steady_clock::now();
  if (!is_due(now)) return;
  due_ = now + account_interval;
  append_when_changed(out, status);
}

void AccountMessages::append_when_changed(mcap::Buffer& out, const RecorderStatus& status) {
  std::string account = account_json(status);
  if (account == last_) return;
  const auto time = static_cast<std::uint64_t>(wall_clock_ns());
  mcap::append(out, mcap::Message{channel_, sequence_, time, time, std::as_bytes(std::span(account))});
  appended_ = std::move(account);
}

void AccountMessages::settle(bool written) noexcept {
  if (written && !appended_.empty()) {
    last_ = std::move(appended_);
    ++sequence_;
  }
  appended_.clear();
}

}  // namespace lbea::mcap
