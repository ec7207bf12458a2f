// What a recorder does, and what became of every message.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string_view>

namespace lbea::mcap {

enum class RecorderState : std::uint8_t { armed, recording, finished, failed };
[[nodiscard]] std::string_view to_string(RecorderState state) noexcept;

struct RecorderStatus {
  struct Lane {
    std::uint64_t recorded = 0;      // in the file
    std::uint64_t no_room = 0;       // lost: the ring was full
    std::uint64_t write_failed = 0;  // lost: the disk did not take it
    std::uint64_t outside = 0;       // before or after the window: nobody asked for it
    [[nodiscard]] std::uint64_t lost() const noexcept { return no_room + write_failed; }
  };
  /// Of the times that were asked for.
  struct Window {
    bool triggered = false;
    std::int64_t begin_ns = 0, end_ns = 0;  // once triggered
  };
  RecorderState state = RecorderState::recording;
  Lane frames, notes;
  std::uint64_t bytes = 0;                                   // in the file
  std::size_t ring_used = 0, ring_peak = 0, ring_bytes = 0;  // of the frames' ring
  std::int64_t longest_write_ns = 0;
  std::uint64_t failed_syncs = 0;
  int last_error = 0;              // the system's number for the last failed write
  std::optional<Window> window{};  // none: everything is recorded
  [[nodiscard]] std::uint64_t lost() const noexcept { return frames.lost() + notes.lost(); }
  /// The file has ended, and nobody had said what to keep.
  [[nodiscard]] bool has_ended_untriggered() const noexcept {
    return window && !window->triggered && (state == RecorderState::finished || state == RecorderState::failed);
  }
  /// Nothing that was to be recorded is missing, so far.
  [[nodiscard]] bool is_sound() const noexcept {
    return lost() == 0 && failed_syncs == 0 && state != RecorderState::failed && !has_ended_untriggered();
  }
};

}  // namespace lbea::mcap
