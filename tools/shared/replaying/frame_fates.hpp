// What the matcher did with the recorded frames, by its recorded results and states.
#pragma once

#include "adapters/wire/codec/messages.hpp"
#include "tools/shared/recording/recorded_run.hpp"

#include <map>

namespace lbea::tool {

/// Session and id.
using FrameKey = std::pair<std::uint64_t, std::uint64_t>;

/// The frames of several rigs that were matched together. Its result has the session and id of `key`, which are those
/// of no frame.
struct RecordedCapture {
  FrameKey key;
  std::int64_t receive_ns = 0;
  std::vector<FrameKey> frames;
  std::vector<std::string> rigs;  // of the frames
};

class FrameFates {
 public:
  /// Reads the whole run. Results that cannot be decoded are ignored.
  explicit FrameFates(RecordedRun& run);
  /// In the order in which they were matched. The functions below know a capture by its key as they know a frame.
  [[nodiscard]] const std::vector<RecordedCapture>& captures() const noexcept { return captures_; }
  /// Of the largest recorded cloud.
  [[nodiscard]] std::size_t most_bytes() const noexcept { return most_bytes_; }
  /// Whether the frame is recorded; of a capture, all of them.
  [[nodiscard]] bool has_frame(const FrameKey& frame) const;
  /// Whether the matcher dropped the frame, or never got it.
  [[nodiscard]] bool was_dropped(const FrameKey& frame) const;
  /// An end of stream ends the test: frames after it belong to another one.
  [[nodiscard]] TestKey test_of(const FrameKey& frame) const;
  /// How often the stream of another session had ended before the matcher had this frame; 0 if that is not known.
  [[nodiscard]] std::uint64_t ends_before(std::uint64_t session, const FrameKey& frame) const;
  /// Whether it is recorded that a stream of the session has ended.
  [[nodiscard]] bool has_end(std::uint64_t session) const { return ends_.contains(session); }
  /// How many frames of the session are recorded, repeated ids included.
  [[nodiscard]] std::uint64_t frames_of(std::uint64_t session) const;
  /// Before the first or after the last frame of its session that is recorded with its result.
  [[nodiscard]] bool is_at_edge(const FrameKey& frame) const;
  /// Whether the matcher had earlier frames of the test, which are not recorded.
  [[nodiscard]] bool lacks_history(const FrameKey& frame) const;

 private:
  struct Fate {
    bool has_frame = false;
    bool is_absent = false;    // missed or withheld
    bool is_searched = false;  // for its match; perhaps none of its points was near any simulation
    bool is_rejected = false, is_dropped = false;
    std::int64_t receive_ns = 0;        // by the matcher's clock, when is_searched
    std::uint64_t frames_of_test = 0;   // that the result sums up
    std::optional<std::size_t> series;  // place in series_
    /// The matcher had the frame, and its answer is recorded.
    [[nodiscard]] bool is_answered() const noexcept { return is_searched || is_rejected || is_dropped; }
  };
  struct End {
    std::uint64_t next_id = 0;
    std::int64_t receive_ns = 0;
  };
  /// The ids for which both frame and result are recorded.
  struct Session {
    std::uint64_t first_id = 0, last_id = 0;
  };
  /// Consecutive frames of one test.
  struct Series {
    TestKey test;
    std::uint64_t first_id = 0;
    std::uint64_t frames = 0;
    bool lacks_history = false;
  };
  void add(const wire::WireResult& result);
  void add(const FrameKey& frame, wire::WireStatus status, const wire::WireResult& result);
  void add_capture(const wire::WireResult& result);
  void add(const wire::WireState& state);
  void find_sessions();
  void find_series(const std::vector<FrameKey>& frames);
  [[nodiscard]] bool never_arrived(const FrameKey& key, const Fate& fate) const;
  [[nodiscard]] bool has_begun_before(const Series& first) const;
  [[nodiscard]] bool had_unrecorded_frames(const wire::WireSender& sender) const;
  /// How many ids below sender.next_id have this property of key and fate.
  template <class Property>
  [[nodiscard]] std::uint64_t count(const wire::WireSender& sender, const Property& has) const;

  std::map<FrameKey, Fate> fates_;
  std::map<std::uint64_t, std::vector<End>> ends_;  // by session
  std::map<std::uint64_t, Session> sessions_;
  std::map<std::uint64_t, std::uint64_t> frames_;            // recorded, by session
  std::map<std::uint64_t, wire::WireSender> senders_;        // in the first state that lists them
  std::map<std::uint64_t, std::uint64_t> first_arrived_id_;  // of the session, where all answers are recorded
  std::vector<Series> series_;
  std::vector<RecordedCapture> captures_;
  std::size_t most_bytes_ = 0;
};

}  // namespace lbea::tool
