// The topics, channels and metadata of a run's recording, as adapters/mcap/RECORDING.md specifies them.
#pragma once

#include "adapters/mcap/records.hpp"
#include "adapters/wire/codec/messages.hpp"

#include <lbea/lbea.hpp>

namespace lbea::tool {

inline constexpr std::string_view frames_topic = "/frames", results_topic = "/results", state_topic = "/state",
                                  recorder_topic = "/recorder";
/// Metadata of frame channels, hexadecimal. With several rigs, the topic ends with "/" and the rig's name.
inline constexpr std::string_view session_key = "session", id_high_key = "id_high";
inline constexpr std::string_view rig_key = "rig";
/// Profiles of a run and of the results of lbea-replay.
inline constexpr std::string_view recording_profile = "lbea", results_profile = "lbea.results";

/// Channel ids; frame channels follow, one per session and upper half of the frame ids.
inline constexpr std::uint16_t results_channel = 1, state_channel = 2, recorder_channel = 3, first_frames_channel = 4;
inline constexpr std::uint16_t results_schema_id = 1, state_schema_id = 2, recorder_schema_id = 3, frames_schema_id = 4;

/// One of several rigs.
struct RigSettings {
  std::string name;
  RigidTransform T_reference_sensor = identity_transform;
  std::int64_t clock_offset_ns = 0;  // added to the stamps of its frames, it gives those of the common clock
  std::string sensor_json{};         // the text of the rig's description; may be empty
};

/// One of several components.
struct ComponentSettings {
  std::string name, model_file;
  std::uint64_t model_checksum = 0;
};

/// As the matcher's state lists them.
[[nodiscard]] std::vector<ComponentSettings> components_of(const wire::WireState& state);

/// The one with this model. model_file, recording: for the message. Throws Error{bad_config} when there is none.
[[nodiscard]] const ComponentSettings& component_with(const std::vector<ComponentSettings>& components,
                                                      std::uint64_t model_checksum, const std::string& model_file,
                                                      const std::string& recording);

/// How a run was matched, so that a replay can match in the same way.
struct RunSettings {
  std::string program;     // with its version
  std::string model_file;  // empty when nothing was matched
  std::uint64_t model_checksum = 0;
  std::string method;
  MatcherConfig matcher;
  std::uint32_t estimates_pose = 0;  // 1: with fit, the pose error of each test was estimated
  std::uint32_t knows_impact = 0;    // 1: --trigger-ns was given
  std::uint32_t frames_alone = 0;    // 1: with fit, frames were matched without what the earlier ones have shown
  std::string sensor_json;           // the text of the rig's description; may be empty
  std::int64_t start_ns = 0;
  std::string record_window{};                  // BEFORE:AFTER in seconds; empty: everything was recorded
  std::vector<RigSettings> rigs{};              // empty: one rig, whose pose `matcher` has
  std::vector<ComponentSettings> components{};  // empty: one model; model_file is that of the first
};

inline constexpr std::string_view settings_metadata_name = "lbea.recording";
[[nodiscard]] mcap::Metadata to_metadata(const RunSettings& settings);
/// One record for each of several rigs, in their order.
inline constexpr std::string_view rig_metadata_name = "lbea.recording.rig";
[[nodiscard]] mcap::Metadata to_metadata(const RigSettings& rig, std::size_t number);
/// The same for each of several components.
inline constexpr std::string_view component_metadata_name = "lbea.recording.component";
[[nodiscard]] mcap::Metadata to_metadata(const ComponentSettings& component, std::size_t number);
/// Throws Error{bad_input} when a text is not a valid number where one is expected, or the pose is not rigid.
[[nodiscard]] RigSettings rig_settings_from(const mcap::Metadata& metadata, const std::string& file);
/// `points`. Throws Error{bad_input} when no program accepts so many: a matcher allocates memory for them.
[[nodiscard]] std::uint32_t checked_max_points(std::uint32_t points, const std::string& file);
/// Throws Error{bad_input} when a text is not a valid number where one is expected, or no matcher has such settings;
/// `file` is for the message.
[[nodiscard]] RunSettings settings_from(const mcap::Metadata& metadata, const std::string& file);

/// Adds what a record of metadata says, if it is one of the three above. Throws the same.
void read(const mcap::Metadata& metadata, RunSettings& into, const std::string& file);

/// The senders at the end of a recording without a matcher, from which missing captures are known. One text per
/// session, with the session number in hexadecimal as key: first_id, next_id, received, missed, withheld, condition.
/// And, with the key "interleaved", Counters::interleaved.
inline constexpr std::string_view senders_metadata_name = "lbea.recording.senders", interleaved_key = "interleaved";
[[nodiscard]] mcap::Metadata to_metadata(const std::vector<wire::WireSender>& senders, std::uint64_t interleaved);
/// Skips texts that cannot be read.
[[nodiscard]] std::vector<wire::WireSender> senders_from(const mcap::Metadata& metadata);

}  // namespace lbea::tool
