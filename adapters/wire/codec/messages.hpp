// What travels on the wire, as plain structs: no FlatBuffers or ZeroMQ type leaves this folder.
#pragma once

#include <lbea/lbea.hpp>

#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace lbea::wire {

/// What may become of a message; the names and numbers of schema/counters.fbs.
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
  // no frame at all
  end_of_stream,
  // dropped: captures of which no frame arrived
  missed,
  withheld,
  // rejected
  duplicate,
};
inline constexpr std::size_t wire_status_count = 17;
/// Stable lower-case name, e.g. "bad_layout"; "unknown_status" for a value that is none of the above.
[[nodiscard]] std::string_view to_string(WireStatus status) noexcept;
/// What is wrong and what to do, e.g. for a log line.
[[nodiscard]] std::string_view explain(WireStatus status) noexcept;

enum class Fate : std::uint8_t { matched, rejected, dropped, not_a_capture };
[[nodiscard]] Fate fate_of(WireStatus status) noexcept;

enum class WireVerdict : std::uint8_t { unknown = 0, matched, low_coverage, refused, ambiguous, no_simulation_fits };
[[nodiscard]] std::string_view to_string(WireVerdict verdict) noexcept;

/// Frames held per peer and side of a connection; at 62,000 points 12 MB.
inline constexpr std::uint32_t default_queued_messages = 16;

/// What a peer may send before it is refused.
struct WireLimits {
  std::uint32_t queued_messages = default_queued_messages;
  std::uint32_t max_points = MatcherConfig{}.max_points;
  /// Room for frames with far too many points, 20 million, so that they are counted and refused in words.
  std::size_t least_message_bytes = std::size_t{1} << 28;
  /// Larger messages never leave the socket layer: the sender is disconnected. Leaves room for wide points.
  [[nodiscard]] std::size_t max_message_bytes() const noexcept {
    const std::size_t wide_points = std::size_t{max_points} * 64 + 65'536;
    return wide_points > least_message_bytes ? wide_points : least_message_bytes;
  }
};

/// How many frames met which end.
struct Counters {
  std::uint64_t received = 0;  // frames, whatever became of them
  std::array<std::uint64_t, wire_status_count> by_status{};
  std::uint64_t missed = 0;      // ids never received: gaps within the sessions
  std::uint64_t duplicates = 0;  // ids that came before
  std::uint64_t reordered = 0;   // frames that came after one with a higher id; no longer missed
  std::uint64_t sessions = 0;
  std::uint64_t silent = 0;       // senders that neither said goodbye nor anything else for seconds
  std::uint64_t unannounced = 0;  // refused or dropped frames of which no result could be published
  std::uint64_t recorded = 0;     // frames that are in the recording's file
  std::uint64_t unrecorded = 0;   // frames and results that a recording was to hold and does not

  [[nodiscard]] std::uint64_t of(WireStatus status) const noexcept {
    return by_status[static_cast<std::size_t>(status)];
  }
  [[nodiscard]] std::uint64_t sum(Fate fate) const noexcept;
  /// What the senders took, as far as their ids and words tell.
  [[nodiscard]] std::uint64_t captured() const noexcept {
    return received + of(WireStatus::missed) + of(WireStatus::withheld);
  }
  /// Received and not yet at an end; never negative, at most what the queues hold.
  [[nodiscard]] std::uint64_t on_the_way() const noexcept {
    return captured() - sum(Fate::matched) - sum(Fate::rejected) - sum(Fate::dropped);
  }
  /// captured = matched + rejected + dropped.
  [[nodiscard]] bool adds_up() const noexcept { return on_the_way() == 0; }
  friend bool operator==(const Counters&, const Counters&) = default;
};

enum class ControlKind : std::uint8_t { hello = 0, heartbeat, goodbye };

/// What a sender says beside its frames: every id below next_id has been given to a capture, and the last
/// `withheld` of them will not come.
struct Control {
  std::uint64_t session = 0;
  ControlKind kind = ControlKind::heartbeat;
  std::uint64_t next_id = 0;
  std::uint64_t withheld = 0;  // at most next_id
  friend bool operator==(const Control&, const Control&) = default;
};

enum class SenderCondition : std::uint8_t { active = 0, ended, silent };

/// What a matcher knows of one sender: next_id - first_id = received + missed + withheld.
struct WireSender {
  std::uint64_t session = 0;
  std::uint64_t first_id = 0, next_id = 0;
  std::uint64_t received = 0, missed = 0, withheld = 0;
  SenderCondition condition = SenderCondition::active;
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

/// What the depth images say: see SurfaceFit. Without candidates: not asked.
struct WireFit {
  float residual = 0, estimate_residual = 0, misfit = 0, spread = 0;
  std::vector<Match> candidates;         // best first; distance: residual
  std::vector<WeightedSample> estimate;  // shares add up to 1
};

struct SimulationChance {
  std::uint32_t simulation = 0;
  float probability = 0;
};

/// What the test so far says: see TestState. Without frames: not asked.
struct WireTestState {
  std::uint64_t frames = 0;
  std::uint32_t simulation = 0;
  Sample sample;
  float sample_probability = 0;
  std::vector<SimulationChance> simulations;  // the likeliest ones, best first
  std::vector<float> branches;
  float misfit = 0;
  WireVerdict verdict = WireVerdict::unknown;
};

struct WireResult {
  std::uint64_t sequence = 0;  // rises by one per message on the results socket
  std::uint64_t session = 0;
  std::uint64_t frame_id = 0;
  std::int64_t stamp_ns = 0;
  WireStatus status = WireStatus::ok;
  WireVerdict verdict = WireVerdict::unknown;
  std::uint32_t reference = 0;
  float coverage = 0;
  PointTally points;
  std::vector<WireMatch> matches;  // nearest first
  std::array<float, 3> leading_coordinates{};
  WireFit fit;
  WireTestState test;
  WireTimes elapsed_ns;
  Counters counters;
  std::int64_t receive_ns = 0;
  std::int64_t publish_ns = 0;
  std::uint64_t model_checksum = 0;
};

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

/// A baked field on the whole component, as the samples that explain a frame have it: see Inferred.
struct WireInference {
  std::uint64_t sequence = 0;  // rises by one per matched frame
  std::uint64_t session = 0;
  std::uint64_t frame_id = 0;
  std::int64_t stamp_ns = 0;
  std::string field{}, unit{};
  FieldInfo::Location location = FieldInfo::Location::element;
  std::vector<float> values{};
  std::vector<float> spread{};  // one per value
  std::uint64_t model_checksum = 0;
};

/// Failed: something that was to be recorded is not in the file, from the first loss on, or the file could not be
/// ended.
enum class RecordingPhase : std::uint8_t { armed, recording, finished, failed };
[[nodiscard]] std::string_view to_string(RecordingPhase phase) noexcept;

/// The file that the matcher program records to.
struct WireRecording {
  static constexpr std::uint64_t unknown = std::numeric_limits<std::uint64_t>::max();
  RecordingPhase phase = RecordingPhase::recording;
  std::uint64_t bytes = 0;             // in the file
  std::uint64_t free_bytes = unknown;  // of its file system, for this program
  bool operator==(const WireRecording&) const = default;
};

/// How the matcher program is set up and how it is doing.
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
};

}  // namespace lbea::wire
