// Matches the captures of several rigs in a recording again.
#pragma once

#include "tools/shared/matching/side_by_side.hpp"
#include "tools/shared/replaying/frame_fates.hpp"
#include "tools/shared/replaying/match_replay.hpp"

#include <set>

namespace lbea::tool {

/// Matches the same frames together as the matcher did, in the same order, so that the results are the same to the last
/// bit.
class RigReplay {
 public:
  /// `settings`: of several rigs; `views`: of each. All arguments must remain. Throws Error{bad_input} when a capture
  /// has a frame of no rig.
  RigReplay(const Model& model, const RunSettings& settings, const std::vector<SensorViews>& views,
            const FrameFates& fates, unsigned threads);
  /// Adds a recorded frame. Results of captures that are complete by it are delivered, those of earlier captures than
  /// `from_ns` not. Returns whether to continue.
  bool add(const RecordedMessage& frame, std::int64_t from_ns, const ResultHandler& handle);
  /// Frames that were in no capture.
  [[nodiscard]] std::uint64_t left_out() const noexcept { return left_out_; }

 private:
  struct Cloud {
    wire::FrameHeader header;
    std::vector<Point> points;
    std::int64_t receive_ns = 0;
  };
  [[nodiscard]] bool is_complete(const RecordedCapture& capture) const;
  [[nodiscard]] wire::WireResult match(const RecordedCapture& capture);
  [[nodiscard]] wire::WireRigFrame frame_of(const RecordedCapture& capture, std::size_t i) const;

  const Model& model_;
  const FrameFates& fates_;
  ModelRigEngine engine_;
  SideBySide threads_;
  wire::Encoder encoder_;
  wire::FrameDecoder decoder_;
  std::map<std::string, std::size_t> rigs_;  // numbers by names
  std::map<FrameKey, Cloud> clouds_;         // of captures that are not complete
  std::set<FrameKey> in_captures_;
  std::vector<const RecordedCapture*> captures_;  // of which all frames are recorded
  std::size_t next_ = 0;
  std::optional<TestKey> test_;
  std::uint64_t left_out_ = 0, sequence_ = 0;
  Outcome outcome_;
};

}  // namespace lbea::tool
