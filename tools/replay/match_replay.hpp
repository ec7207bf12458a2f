// Matches recorded frames. The same recording and model give the same results to the last bit on any number of
// threads.
#pragma once

#include "adapters/wire/codec/codec.hpp"
#include "tools/shared/intake/id_tracker.hpp"
#include "tools/shared/matching/match_engine.hpp"
#include "tools/shared/recording/recorded_run.hpp"

#include <barrier>
#include <functional>
#include <thread>

namespace lbea::tool {

/// Receives a result without times other than the frame's own and without counters. Returns whether to continue.
using ResultHandler = std::function<bool(const wire::WireResult& result)>;

class MatchReplay {
 public:
  MatchReplay(const Model& model, const MatcherConfig& config, const SensorViews& views, unsigned threads);
  ~MatchReplay();
  MatchReplay(const MatchReplay&) = delete;
  MatchReplay& operator=(const MatchReplay&) = delete;

  /// Adds a recorded frame. Its result is delivered during this call or a later one, in the order of the frames.
  /// Without `is_wanted` the frame only contributes to the test's history.
  bool add(const RecordedMessage& frame, bool is_wanted, const ResultHandler& handle);
  /// Registers the id of an earlier frame, so that later frames with this id are repetitions.
  void skip(const RecordedMessage& frame) { static_cast<void>(ids_.observe(frame.session, frame.id)); }
  /// Delivers the remaining results.
  bool flush(const ResultHandler& handle);

 private:
  struct Slot {
    std::unique_ptr<ModelEngine> engine;
    wire::FrameHeader header;
    std::int64_t receive_ns = 0;
    wire::WireStatus status = wire::WireStatus::ok;
    std::vector<Point> points;
    MatchResult match;
    bool is_wanted = true;
  };
  void work(Slot& slot);
  void end_workers() noexcept;
  void run_batch();
  wire::WireResult result_of(Slot& slot);

  std::uint64_t model_checksum_;
  wire::Encoder encoder_;
  wire::FrameDecoder decoder_;
  IdTracker ids_;
  std::vector<Slot> slots_;  // one matcher per thread; the tracker of the first one sums up the test
  std::size_t filled_ = 0;
  std::uint64_t session_ = 0, sequence_ = 0;
  Outcome outcome_;
  bool stopping_ = false;
  std::barrier<> begin_, end_;
  std::vector<std::thread> workers_;
};

}  // namespace lbea::tool
