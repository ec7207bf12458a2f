// The messages of the wire as plain structs, without types of FlatBuffers or ZeroMQ.
#pragma once

#include <lbea/forecast.hpp>
#include <lbea/lbea.hpp>

#include <chrono>
#include <optional>

namespace lbea::wire {
/// The system's clock: ns since 1970.
[[nodiscard]] inline std::int64_t system_clock_ns() noexcept {
  return std::chrono::system_clock::now().time_since_epoch() / std::chrono::nanoseconds(1);
}

/// The clock of all stamps and recordings: ns since 1970 by the steady clock. A step of the system's clock while the
/// program runs does not change it.
[[nodiscard]] inline std::int64_t wall_clock_ns() noexcept {
  const auto steady_ns = [] {
    return std::chrono::steady_clock::now().time_since_epoch() / std::chrono::nanoseconds(1);
  };
  static const std::int64_t offset_ns = system_clock_ns() - steady_ns();
  return steady_ns() + offset_ns;
}

/// The status of a message; names and numbers are those of schema/counters.fbs.
enum class WireStatus : std::uint8_t {
  ok = 0,
  low_coverage,
  // rejected
  empty_frame,
  too_many_points,
  message_too_large,
  wrong_kind,
  damaged,
  bad_cloud,
  bad_layout,
  bad_fields,
  bad_stamp,
  unsupported_pose,
  // dropped
  queue_full,
  // not a frame
  end_of_stream,
  // dropped: captures of which no frame arrived
  missed,
  withheld,
  // rejected
  duplicate,
  // dropped
  other_sender,
  out_of_step,
};
inline constexpr std::size_t wire_status_count = 19;
/// Stable lower-case name, e.g. "bad_layout"; "unknown_status" for a value that is none of the above.
[[nodiscard]] std::string_view to_string(WireStatus status) noexcept;
/// What is wrong and what to do, for a log line.
[[nodiscard]] std::string_view explain(WireStatus status) noexcept;

enum class Fate : std::uint8_t { matched, rejected, dropped, not_a_capture };
[[nodiscard]] Fate fate_of(WireStatus status) noexcept;
[[nodiscard]] std::string_view to_string(Fate fate) noexcept;

enum class WireVerdict : std::uint8_t { unknown = 0, matched, low_coverage, refused, ambiguous, no_simulation_fits };
[[nodiscard]] std::string_view to_string(WireVerdict verdict) noexcept;

/// Frames held per peer and side of a connection; at 62,000 points 12 MB.
inline constexpr std::uint32_t default_queued_messages = 16;

/// Limits for received messages.
struct WireLimits {
  std::uint32_t queued_messages = default_queued_messages;
  static constexpr std::uint32_t most_points = 1u << 24;  // max_points that programs accept
  std::uint32_t max_points = MatcherConfig{}.max_points;
  /// Frames with far too many points, up to 20 million, still arrive, so that they are counted and rejected with a
  /// reason.
  std::size_t least_message_bytes = std::size_t{1} << 28;
  /// The socket layer discards larger messages and disconnects their sender. Allows points of 64 bytes.
  [[nodiscard]] std::size_t max_message_bytes() const noexcept {
    const std::size_t wide_points = std::size_t{max_points} * 64 + 65'536;
    return wide_points > least_message_bytes ? wide_points : least_message_bytes;
  }
};

/// The number of frames by status.
struct Counters {
  std::uint64_t received = 0;  // frames, whatever their status
  std::array<std::uint64_t, wire_status_count> by_status{};
  std::uint64_t missed = 0;      // ids never received: gaps in the sessions
  std::uint64_t duplicates = 0;  // ids that arrived before
  std::uint64_t reordered = 0;   // frames that arrived after one with a higher id; no longer missed
  std::uint64_t sessions = 0;
  std::uint64_t silent = 0;       // senders without a message for seconds and without a goodbye
  std::uint64_t interleaved = 0;  // returns to a sender while the test of another one was running
  std::uint64_t unannounced = 0;  // rejected or dropped frames without a published result
  std::uint64_t recorded = 0;     // frames in the recording
  std::uint64_t unrecorded = 0;   // frames and results missing from the recording

  [[nodiscard]] std::uint64_t of(WireStatus status) const noexcept {
    return by_status[static_cast<std::size_t>(status)];
  }
  [[nodiscard]] std::uint64_t sum(Fate fate) const noexcept;
  /// Captures of the senders, by their ids and control messages.
  [[nodiscard]] std::uint64_t captured() const noexcept {
    return received + of(WireStatus::missed) + of(WireStatus::withheld);
  }
  /// Received and without a status yet; never negative, at most what the queues hold.
  [[nodiscard]] std::uint64_t on_the_way() const noexcept {
    return captured() - sum(Fate::matched) - sum(Fate::rejected) - sum(Fate::dropped);
  }
  /// Of several rigs together.
  Counters& operator+=(const Counters& more) noexcept;
  /// captured = matched + rejected + dropped.
  [[nodiscard]] bool adds_up() const noexcept { return on_the_way() == 0; }
  friend bool operator==(const Counters&, const Counters&) = default;
};

enum class ControlKind : std::uint8_t { hello = 0, heartbeat, goodbye };

/// A sender's control message: every id below next_id was given to a capture, and the last `withheld` of them will not
/// be sent.
struct Control {
  std::uint64_t session = 0;
  ControlKind kind = ControlKind::heartbeat;
  std::uint64_t next_id = 0;
  std::uint64_t withheld = 0;  // at most next_id
  friend bool operator==(const Control&, const Control&) = default;
};

enum class SenderCondition : std::uint8_t { active = 0, ended, silent };

/// The account of one sender: next_id - first_id = received + missed + withheld.
struct WireSender {
  std::uint64_t session = 0;
  std::uint64_t first_id = 0, next_id = 0;
  std::uint64_t received = 0, missed = 0, withheld = 0;
  SenderCondition condition = SenderCondition::active;
  std::string rig{};  // of several: the one that it sends the frames of
  friend bool operator==(const WireSender&, const WireSender&) = default;
};

struct WireMatch {
  Sample sample;
  std::string simulation_name;
  double time_s = 0;
  float distance = 0;
};

/// ns; zero for stages a frame never reached.
struct WireTimes {
  std::uint32_t decode = 0;
  std::uint32_t queue = 0;  // waiting for the matcher
  StageTimes match;
  std::uint32_t total = 0;  // receive_ns to publish_ns
};

/// See SurfaceFit. Without candidates: another method than fit.
struct WireFit : FitNumbers {
  std::vector<Match> candidates;         // best first; distance: residual
  std::vector<float> ranks;              // per candidate; none in recordings of lbea 0.1
  std::vector<WeightedSample> estimate;  // weights add up to 1

  [[nodiscard]] SurfaceFit view() const& noexcept { return {*this, candidates, ranks, estimate}; }
  SurfaceFit view() && = delete;
};

struct SimulationChance {
  std::uint32_t simulation = 0;
  float probability = 0;
};

/// See TestState. Without frames: another method than fit.
struct WireTestState {
  std::uint64_t frames = 0;
  std::uint32_t simulation = 0;
  Sample sample;
  float sample_probability = 0;
  std::vector<SimulationChance> simulations;  // the most probable ones, best first
  std::vector<float> branches;
  float misfit = 0;
  WireVerdict verdict = WireVerdict::unknown;
};

struct RunWeight {
  std::uint32_t simulation = 0;
  float weight = 0;
};

/// See TestForecast. Without frames: another method than fit, or nothing seen yet.
struct WireForecast {
  std::uint64_t frames = 0;
  float error_90 = 0;
  std::vector<RunWeight> runs;
  std::vector<float> branches;
  std::vector<ParameterForecast> parameters;
};

struct WireChannel : ChannelValue {
  std::string name, unit;
  ChannelValue end{};  // forecast
};

/// That programs accept.
inline constexpr std::size_t most_rigs = 16;

/// One rig's frame in the result of a capture of several rigs; see RigResult.
struct WireRigFrame : FitNumbers, FrameNumbers {
  std::string rig{};
  std::uint64_t session = 0;
  std::uint64_t frame_id = 0;
  std::int64_t stamp_ns = 0;  // by the clock of the rig
  WireStatus status = WireStatus::ok;
  WireVerdict verdict = WireVerdict::unknown;  // by this frame alone
  PointTally points{};
  bool is_used = false;  // the capture's result rests on it
  std::int64_t clock_correction_ns = 0;
};

/// That programs accept.
inline constexpr std::size_t most_components = 16;

/// Of a frame; or of a capture of several rigs, whose session is that of no sender.
struct WireResult : FrameNumbers {
  std::uint64_t sequence = 0;  // rises by one per message on the results socket
  std::uint64_t session = 0;
  std::uint64_t frame_id = 0;
  std::int64_t stamp_ns = 0;
  WireStatus status = WireStatus::ok;
  WireVerdict verdict = WireVerdict::unknown;
  std::uint32_t reference = 0;
  PointTally points;
  std::uint32_t points_near_none = 0;  // with several models: near no simulation of any component
  std::vector<WireMatch> matches;      // nearest first
  std::array<float, 3> leading_coordinates{};
  WireFit fit;
  WireTestState test;
  WireForecast forecast;
  std::vector<WireChannel> channels;  // in the order of the model
  std::vector<WireRigFrame> rigs;     // the frames of the capture; empty: this is the result of one frame
  std::string component;              // with several models: by which one; empty: one model, or of the whole frame
  WireTimes elapsed_ns;
  Counters counters;
  std::int64_t receive_ns = 0;
  std::int64_t publish_ns = 0;
  std::uint64_t model_checksum = 0;
};

/// Calls visit(session, frame_id, status) for each frame that the result answers.
template <class Visit>
void for_each_frame(const WireResult& result, const Visit& visit) {
  if (result.rigs.empty()) visit(result.session, result.frame_id, result.status);
  for (const WireRigFrame& frame : result.rigs) visit(frame.session, frame.frame_id, frame.status);
}

struct ModelSummary {
  std::string file;
  std::uint64_t checksum = 0;
  std::uint32_t vertices = 0;
  std::uint32_t modes = 0;
  std::uint32_t samples = 0;
  std::uint32_t references = 0;
  std::string length_unit;
  std::vector<std::string> simulations;  // names
};

/// One of several components of a test.
struct WireComponent {
  std::string name;
  ModelSummary model;
};

/// A baked field on the whole component, inferred from the samples that explain a frame: see Inferred.
struct WireInference {
  std::uint64_t sequence = 0;  // rises by one per inference
  std::uint64_t session = 0;
  std::uint64_t frame_id = 0;
  std::int64_t stamp_ns = 0;
  std::string field{}, unit{};
  FieldInfo::Location location = FieldInfo::Location::element;
  std::vector<float> values{};
  std::vector<float> spread{};  // one per value
  std::uint64_t model_checksum = 0;
  std::vector<float> bound_90{};  // one per value, or empty
  std::string component{};        // of several; else empty
};

/// failed: from the first loss on, or when the file could not be completed.
enum class RecordingPhase : std::uint8_t { armed, recording, finished, failed };
[[nodiscard]] std::string_view to_string(RecordingPhase phase) noexcept;

/// The state of the matcher program's recording.
struct WireRecording {
  static constexpr std::uint64_t unknown = std::numeric_limits<std::uint64_t>::max();
  RecordingPhase phase = RecordingPhase::recording;
  std::uint64_t bytes = 0;             // in the file
  std::uint64_t free_bytes = unknown;  // of its file system, available to this program
  bool operator==(const WireRecording&) const = default;
};

/// One of several rigs: its description and account.
struct WireRig {
  std::string name;
  std::string endpoint;  // of its frames
  std::int64_t clock_offset_ns = 0;
  Counters counters;
};

/// Settings and current state of the matcher program.
struct WireState {
  std::uint64_t sequence = 0;
  std::int64_t publish_ns = 0;
  std::int64_t start_ns = 0;
  std::string version;
  std::string method;
  std::uint32_t max_points = 0;
  std::uint32_t queue_slots = 0;
  std::uint32_t queue_used = 0;
  Counters counters;
  ModelSummary model;
  std::uint64_t max_message_bytes = 0;       // larger ones never arrive
  std::vector<WireSender> senders{};         // the latest ones
  std::optional<WireRecording> recording{};  // none: nothing is recorded
  std::vector<WireRig> rigs{};               // none: one rig, whose account `counters` is
  std::vector<WireComponent> components{};   // none: one model; `model` is that of the first
};
}  // namespace lbea::wire
