// A recording's schemas and channels, written at first, after a chunk was lost, and now and then, so that what is left
// of a damaged file can be read.
#pragma once

#include "adapters/mcap/record_walk.hpp"
#include "adapters/mcap/recorder_config.hpp"

namespace lbea::mcap {

/// One thread's.
class RepeatedDefinitions {
 public:
  RepeatedDefinitions(const RecordingStart& start, std::chrono::milliseconds interval);
  /// A schema's or channel's record on its way.
  void take(const mcap::Record& record);
  /// Appends them all to the front of a chunk when they are due.
  void append_when_due(mcap::Buffer& front, bool has_messages);
  /// Whether that chunk is in the file.
  void settle(bool written) noexcept { changed_ = !written; }

 private:
  using Clock = std::chrono::steady_clock;
  mcap::Definitions definitions_;
  std::chrono::milliseconds interval_;
  Clock::time_point due_{};
  bool changed_ = true;  // since they were last in the file
};

}  // namespace lbea::mcap
