// The settings of a recorder, what its file starts with, and its status.
#pragma once

#include "adapters/mcap/bytes.hpp"
#include "adapters/wire/codec/messages.hpp"

#include <chrono>

namespace lbea::tool {

/// Only what happens around a trigger is recorded.
struct RecordWindow {
  std::chrono::nanoseconds before{0}, after{0};
};

struct RecorderConfig {
  std::size_t frame_ring_bytes = std::size_t{512} << 20;  // frames waiting for the disk; 0.7 s of 62k points at 1,000/s
  std::size_t note_ring_bytes = std::size_t{8} << 20;     // the same for all other messages
  std::size_t chunk_bytes = std::size_t{4} << 20;         // a chunk is written at this size, ...
  std::chrono::milliseconds longest_wait{5};              // ... or when its first message has waited this long
  std::chrono::milliseconds sync_interval{1000};          // between two syncs to the disk; 0: only at the end
  std::chrono::milliseconds definitions_interval{1000};   // between repetitions of schemas and channels
  // Frames leave this much of the disk, at most an eighth of what is free at the start, to results and states.
  std::uint64_t disk_reserve_bytes = std::uint64_t{64} << 20;
  mcap::Compression compression = mcap::Compression::none;
  std::optional<RecordWindow> window;  // none: everything is recorded
};

/// What the file starts with.
struct RecordingStart {
  mcap::Header header;
  std::vector<mcap::Schema> schemas;
  std::vector<mcap::Channel> channels;
  std::vector<mcap::Metadata> metadata;
  std::uint16_t status_channel = 0;  // one of `channels`: for the recorder's loss reports, as JSON
};

struct RecorderStatus {
  /// What became of the messages of one queue.
  struct Queue {
    std::uint64_t recorded = 0;      // in the file
    std::uint64_t no_room = 0;       // lost: the ring was full
    std::uint64_t write_failed = 0;  // lost: the disk did not accept it
    std::uint64_t outside = 0;       // before or after the window, so not wanted
    [[nodiscard]] std::uint64_t lost() const noexcept { return no_room + write_failed; }
  };
  struct Window {
    bool triggered = false;
    std::int64_t begin_ns = 0, end_ns = 0;  // once triggered
  };
  wire::RecordingPhase phase = wire::RecordingPhase::recording;
  Queue frames, notes;
  std::uint64_t bytes = 0;                                   // in the file
  std::size_t ring_used = 0, ring_peak = 0, ring_bytes = 0;  // of the frames' ring
  std::int64_t longest_write_ns = 0;
  std::uint64_t failed_syncs = 0;
  int last_error = 0;              // the system's error number of the last failed write
  std::optional<Window> window{};  // none: everything is recorded
  [[nodiscard]] std::uint64_t lost() const noexcept { return frames.lost() + notes.lost(); }
  /// The file was closed before any trigger.
  [[nodiscard]] bool has_ended_untriggered() const noexcept {
    return window && !window->triggered &&
           (phase == wire::RecordingPhase::finished || phase == wire::RecordingPhase::failed);
  }
  /// Nothing that was to be recorded is missing so far.
  [[nodiscard]] bool is_sound() const noexcept {
    return lost() == 0 && failed_syncs == 0 && phase != wire::RecordingPhase::failed && !has_ended_untriggered();
  }
};

}  // namespace lbea::tool
