// Records messages as they come, on a thread of its own: whoever hands them over waits for nothing. What finds no
// room in memory or on the disk is counted by reason, and the counts stand in the recording too.
#pragma once

#include "adapters/recording/mcap_writer.hpp"
#include "adapters/recording/record_ring.hpp"

#include <chrono>
#include <deque>
#include <memory>
#include <thread>

namespace lbea {

/// Keeps only what happens around a trigger.
struct RecordWindow {
  std::chrono::nanoseconds before{0}, after{0};
};

struct RecorderConfig {
  std::size_t frame_ring_bytes = std::size_t{512} << 20;  // waits for the disk; 0.7 s of 62k points at 1,000/s
  std::size_t note_ring_bytes = std::size_t{8} << 20;     // the same for everything else
  std::size_t chunk_bytes = std::size_t{4} << 20;         // a chunk is closed when it has so much, ...
  std::chrono::milliseconds longest_wait{5};              // ... or when its first message has waited so long
  std::chrono::milliseconds sync_interval{1000};          // how often all is forced to the disk; 0: at the end
  std::chrono::milliseconds definitions_interval{1000};   // schemas and channels are repeated so often
  mcap::Compression compression = mcap::Compression::none;
  std::optional<RecordWindow> window;  // none: everything is recorded
};

/// What stands at the front of the file.
struct RecordingStart {
  mcap::Header header;
  std::vector<mcap::Schema> schemas;
  std::vector<mcap::Channel> channels;
  std::vector<mcap::Metadata> metadata;
  std::uint16_t status_channel = 0;  // one of `channels`: takes the recorder's own account, as JSON
};

enum class RecorderState : std::uint8_t { armed, recording, finished, failed };
[[nodiscard]] std::string_view to_string(RecorderState state) noexcept;

struct RecorderStatus {
  struct Lane {
    std::uint64_t recorded = 0;       // in the file
    std::uint64_t no_room = 0;        // lost: the ring was full
    std::uint64_t write_failed = 0;   // lost: the disk did not take it
    std::uint64_t outside = 0;        // before or after the window: nobody asked for it
    [[nodiscard]] std::uint64_t lost() const noexcept { return no_room + write_failed; }
  };
  RecorderState state = RecorderState::recording;
  Lane frames, notes;
  std::uint64_t bytes = 0;               // in the file
  std::size_t ring_used = 0, ring_peak = 0, ring_bytes = 0;  // of the frames' ring
  std::int64_t longest_write_ns = 0;
  std::uint64_t failed_syncs = 0;
  int last_error = 0;  // the system's number for the last failed write
  [[nodiscard]] std::uint64_t lost() const noexcept { return frames.lost() + notes.lost(); }
  /// Nothing that was to be recorded is missing, so far.
  [[nodiscard]] bool is_sound() const noexcept {
    return lost() == 0 && failed_syncs == 0 && state != RecorderState::failed;
  }
};

class Recorder {
 public:
  enum class Lane : std::uint8_t { frames, notes };

  /// Writes the start of the file and begins. Throws Error{write_failed | bad_config}.
  Recorder(std::unique_ptr<mcap::Sink> sink, const RecorderConfig& config, const RecordingStart& start);
  ~Recorder();
  Recorder(const Recorder&) = delete;
  Recorder& operator=(const Recorder&) = delete;

  // One thread per lane; neither blocks nor allocates.
  /// False when it was lost, which is counted.
  bool put(Lane lane, const mcap::Message& message) noexcept;
  /// A channel record in bytes, before the first message on it. False when there is no room; nothing is counted.
  bool put_channel(Lane lane, mcap::Bytes record) noexcept;

  /// Something happened at `log_time`: with a window, it is recorded around this time. Only the first one counts.
  void trigger(std::int64_t log_time_ns) noexcept;
  [[nodiscard]] RecorderStatus status() const noexcept;
  /// Records what was put so far, ends the file and gives it its name. At the latest done by the destructor, which however
  /// leaves nothing of a recording without a single frame: the program did not come to recording.
  RecorderStatus finish() noexcept;

 private:
  using Clock = std::chrono::steady_clock;
  struct LaneState {
    explicit LaneState(std::size_t bytes) : ring(bytes) {}
    mcap::RecordRing ring;
    std::atomic<std::uint64_t> recorded{0}, no_room{0}, write_failed{0}, outside{0};
    std::deque<std::int64_t> pushed_out;  // log times of what a full ring lost while armed
    bool is_past_window = false;
  };
  /// Whole records at the front of a lane.
  struct Cut {
    mcap::Bytes records;
    std::uint64_t messages = 0;
  };

  void write_start(const RecordingStart& start);
  void start_threads();
  void run() noexcept;
  void run_syncs() noexcept;
  bool try_tick(bool last) noexcept;
  void tick(bool last);
  void forget_old(LaneState& lane, std::int64_t now_ns);
  void begin_window();
  void end_window();
  bool window_is_over(std::int64_t now_ns) const;
  void drop_front(LaneState& lane, const mcap::Record& record, std::atomic<std::uint64_t>& count);
  Cut cut(LaneState& lane, std::size_t most);
  void note_definition(const mcap::Record& record);
  bool write_chunk();
  int write(std::span<const mcap::Bytes> pieces) noexcept;
  [[nodiscard]] bool definitions_are_due(bool has_messages) const;
  void add_definitions();
  void add_account();
  void end_file() noexcept;

  std::unique_ptr<mcap::Sink> sink_;
  RecorderConfig config_;
  mcap::Writer writer_;
  LaneState frames_, notes_;
  std::uint16_t status_channel_;

  // the writing thread's
  mcap::Definitions definitions_;
  mcap::Buffer front_;  // of the chunk: definitions, the account
  Clock::time_point waiting_since_{}, definitions_due_{}, account_due_{};
  std::string account_;  // as last written
  std::uint32_t account_sequence_ = 0;
  bool definitions_changed_ = true;

  std::atomic<std::int64_t> trigger_ns_;
  std::atomic<RecorderState> state_;
  std::atomic<std::uint64_t> bytes_{0}, failed_syncs_{0};
  std::atomic<std::size_t> ring_peak_{0};
  std::atomic<std::int64_t> longest_write_ns_{0};
  std::atomic<int> last_error_{0};
  std::atomic<bool> stopping_{false}, writing_done_{false}, abandoned_{false};
  std::thread writer_thread_, sync_thread_;
};

}  // namespace lbea
