// The channels of our recordings; RECORDING.md beside the recorder specifies them.
#pragma once

#include <cstdint>
#include <string_view>

namespace lbea::tool {

inline constexpr std::string_view frames_topic = "/frames", results_topic = "/results", state_topic = "/state",
                                  recorder_topic = "/recorder";
inline constexpr std::string_view session_key = "session",
                                  id_high_key = "id_high";  // metadata of frames' channels, hexadecimal
inline constexpr std::string_view recording_profile = "lbea",
                                  results_profile = "lbea.results";  // a run; what lbea-replay made of one

/// Channel ids; those of frames follow, one per session and upper half of the frame ids.
inline constexpr std::uint16_t results_channel = 1, state_channel = 2, recorder_channel = 3, first_frames_channel = 4;
/// Schema ids.
inline constexpr std::uint16_t results_schema_id = 1, state_schema_id = 2, recorder_schema_id = 3, frames_schema_id = 4;

}  // namespace lbea::tool
