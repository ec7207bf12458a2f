// What a recording says about the run it is of, so that a replay can match in the same way.
#pragma once

#include "adapters/mcap/mcap_records.hpp"

#include <lbea/lbea.hpp>

#include <filesystem>
#include <optional>
#include <string>

namespace lbea::tool {

struct RunSettings {
  std::string program;     // and its version
  std::string model_file;  // empty when nothing was matched
  std::uint64_t model_checksum = 0;
  std::string method;
  MatcherConfig matcher;
  std::string sensor_json;  // the rig's description as it was given; may be empty
  std::int64_t start_ns = 0;
  std::string record_window{};  // BEFORE:AFTER in seconds; empty: all was recorded
};

/// The metadata record of that name.
inline constexpr std::string_view settings_metadata_name = "lbea.recording";
[[nodiscard]] mcap::Metadata to_metadata(const RunSettings& settings);
/// Throws Error{bad_input} when a text is not the number it should be; `file` is for the sentence.
[[nodiscard]] RunSettings settings_from(const mcap::Metadata& metadata, const std::string& file);

}  // namespace lbea::tool
