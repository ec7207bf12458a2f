// Recorded frames straight into matchers: the same recording and model give the same results to the last bit, on
// however many threads.
#pragma once

#include "adapters/wire/codec/codec.hpp"
#include "tools/shared/intake/id_tracker.hpp"
#include "tools/shared/matching/match_engine.hpp"
#include "tools/shared/recording/recorded_run.hpp"

#include <barrier>
#include <functional>
#include <thread>

namespace lbea::tool {

/// Hands on a result without what differs from run to run: no times but the frame's own, no counters. Returns
/// whether to go on.
using ResultTaker = std::function<bool(const wire::WireResult& result)>;

class MatchReplay {
 public:
  MatchReplay(const Model& model, const MatcherConfig& config, const SensorViews& views, unsigned threads);
  ~MatchReplay();
  MatchReplay(const MatchReplay&) = delete;
  MatchReplay& operator=(const MatchReplay&) = delete;

  /// One recorded frame. Its result comes with this call or a later one, in the order of the frames; only the test's
  /// history hears of it when nobody asked for it.
  bool add(const RecordedMessage& frame, bool is_asked, const ResultTaker& take);
  /// A frame before those: it is not matched, and later ones with its id come twice.
  void pass_over(const RecordedMessage& frame) { static_cast<void>(ids_.observe(frame.session, frame.id)); }
  /// The results that are still out.
  bool flush(const ResultTaker& take);

 private:
  struct Slot {
    std::unique_ptr<ModelEngine> engine;
    wire::FrameHeader header;
    std::int64_t receive_ns = 0;
    wire::WireStatus status = wire::WireStatus::ok;
    std::vector<Point> points;
    MatchResult match;
    bool is_asked = true;
  };
  void work(Slot& slot);
  void end_workers() noexcept;
  void run_batch();
  wire::WireResult result_of(Slot& slot);

  std::uint64_t model_checksum_;
  wire::Encoder encoder_;
  wire::FrameDecoder decoder_;
  IdTracker ids_;
  std::vector<Slot> slots_;  // one per thread, with a matcher each; the first one's tracker adds up the test
  std::size_t filled_ = 0;
  std::uint64_t session_ = 0, sequence_ = 0;
  Outcome outcome_;
  bool stopping_ = false;
  std::barrier<> begin_, end_;
  std::vector<std::thread> workers_;
};

}  // namespace lbea::tool
