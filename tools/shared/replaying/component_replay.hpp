// Matches the frames of a recording again with the models of several components.
#pragma once

#include "tools/shared/matching/component_engine.hpp"
#include "tools/shared/matching/side_by_side.hpp"
#include "tools/shared/replaying/match_replay.hpp"

namespace lbea::tool {

/// One frame after the other, as the matcher did, so that the results are the same to the last bit. Each frame has a
/// result of each component, in their order; one that the matcher did not get has one.
class ComponentReplay {
 public:
  /// All arguments must remain.
  ComponentReplay(const std::vector<ComponentModel>& components, const RunSettings& settings, unsigned threads);
  /// Adds a recorded frame and delivers its results if it is wanted. Returns whether to continue.
  bool add(const ReplayedFrame& replayed, const ResultHandler& handle);
  /// Registers the id of an earlier frame, so that later frames with this id are repetitions.
  void skip(const RecordedMessage& frame) { static_cast<void>(ids_.observe(frame.session, frame.id)); }

 private:
  bool match(const ReplayedFrame& replayed, const ResultHandler& handle);
  [[nodiscard]] wire::WireResult result_of(std::size_t component, const ReplayedFrame& replayed);

  const std::vector<ComponentModel>& components_;
  ModelComponents engine_;
  wire::Encoder encoder_;
  wire::FrameDecoder decoder_;
  IdTracker ids_;
  std::vector<Point> points_;         // of the frame
  std::vector<MatchResult> results_;  // of each component
  std::optional<TestKey> test_;       // none before its first frame
  std::uint64_t sequence_ = 0;
  Outcome outcome_;
  SideBySide threads_;
};

}  // namespace lbea::tool
