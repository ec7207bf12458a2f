// The recorder's own account, for the recording itself.
#pragma once

#include "adapters/mcap/mcap_records.hpp"
#include "adapters/mcap/recorder_status.hpp"

#include <chrono>
#include <string>

namespace lbea::mcap {

/// What changes only when something was lost or the state changes, as one JSON object.
[[nodiscard]] std::string account_json(const RecorderStatus& status);
/// The JSON schema of that.
[[nodiscard]] std::string_view account_schema() noexcept;
/// The last record of the data: how many messages there should be.
[[nodiscard]] mcap::Metadata closing_metadata(const RecorderStatus& status);
inline constexpr std::string_view closing_metadata_name = "lbea.recording.end";
/// In it, with a window: "yes" or "no", and from when to when, in the recorder's time.
inline constexpr std::string_view triggered_key = "triggered", window_begin_key = "window_begin_ns",
                                  window_end_key = "window_end_ns";
/// Frames that came before or after it.
inline constexpr std::string_view frames_outside_key = "frames_outside";

/// The account as messages of a recording, one whenever it has changed. One thread's.
class AccountMessages {
 public:
  explicit AccountMessages(std::uint16_t channel) : channel_(channel) {}
  /// Whether it is time to look at it again.
  [[nodiscard]] bool is_due(std::chrono::steady_clock::time_point now) const noexcept { return now >= due_; }
  void append_when_due(mcap::Buffer& out, const RecorderStatus& status);
  void append_when_changed(mcap::Buffer& out, const RecorderStatus& status);
  /// What was appended is in the file, or it is not: then it is due again.
  void settle(bool written) noexcept;

 private:
  std::uint16_t channel_;
  std::uint32_t sequence_ = 0;
  std::chrono::steady_clock::time_point due_{};
  std::string last_, appended_;
};

}  // namespace lbea::mcap
