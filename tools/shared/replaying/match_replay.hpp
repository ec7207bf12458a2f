// Matches the frames of a recording again.
#pragma once

#include "adapters/wire/codec/codec.hpp"
#include "tools/shared/intake/id_tracker.hpp"
#include "tools/shared/matching/match_engine.hpp"
#include "tools/shared/matching/side_by_side.hpp"
#include "tools/shared/replaying/match_settings.hpp"

#include <functional>
#include <memory>

namespace lbea::tool {

/// Receives a result without times other than the frame's own and without counters. Returns whether to continue.
using ResultHandler = std::function<bool(const wire::WireResult& result, const TestKey& test)>;

/// A recorded frame. One that is not wanted only contributes to the test's history.
struct ReplayedFrame {
  const RecordedMessage& message;
  TestKey test;
  bool is_wanted = true;
};

/// Matches recorded frames. The same recording and model give the same results to the last bit on any number of
/// threads.
class MatchReplay {
 public:
  /// `model` and `views` must remain.
  MatchReplay(const Model& model, const RunSettings& settings, const SensorViews& views, unsigned threads);

  /// Adds a recorded frame. Its result is delivered during this call or a later one, in the order of the frames.
  bool add(const ReplayedFrame& replayed, const ResultHandler& handle);
  /// Registers the id of an earlier frame, so that later frames with this id are repetitions.
  void skip(const RecordedMessage& frame) { static_cast<void>(ids_.observe(frame.session, frame.id)); }
  /// Delivers the remaining results.
  bool flush(const ResultHandler& handle);

 private:
  struct Slot {
    std::unique_ptr<Matcher> matcher;
    std::uint32_t max_points = 0;  // of the matcher
    wire::FrameHeader header;
    std::int64_t receive_ns = 0;
    wire::WireStatus status = wire::WireStatus::ok;
    std::vector<Point> points;
    MatchResult match;
    TestKey test;
    bool is_wanted = true;
  };
  [[nodiscard]] MatcherConfig with_max_points(std::uint32_t points) const;
  void make_room(Slot& slot) const;
  void match(Slot& slot);
  void run_batch();
  void begin_test_of(const Slot& slot);
  [[nodiscard]] wire::WireResult result_of(Slot& slot);

  const Model& model_;
  const MatcherConfig config_;
  const SensorViews& views_;
  wire::Encoder encoder_;
  wire::FrameDecoder decoder_;
  IdTracker ids_;
  ModelTest<TestEngine> engine_;
  std::optional<TestHistory> history_;
  std::vector<Slot> slots_;  // one matcher per thread
  std::size_t filled_ = 0;
  std::optional<TestKey> test_;  // none before its first frame
  std::uint64_t sequence_ = 0;
  Outcome outcome_;
  SideBySide threads_;
};

}  // namespace lbea::tool
