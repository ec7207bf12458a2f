// Prints the contents of a model or a recording.
#pragma once

#include "tools/shared/text/formatted.hpp"
#include "tools/shared/text/printable.hpp"

#include <nlohmann/json.hpp>

#include <cstdint>
#include <filesystem>
#include <string>

namespace lbea::tool {

/// Prints the contents of a model, after it has verified the whole file. Throws the error of Model::open when the file
/// is damaged.
void print_model(const std::filesystem::path& file, bool as_json);
/// Prints the runs that were added, withdrawn or changed, and changed sizes, settings and sections. Verifies both files
/// and throws the error of Model::open when one is damaged.
void print_diff(const std::filesystem::path& before, const std::filesystem::path& after, bool as_json);

/// Whether the file has the name or the first bytes of a recording (MCAP).
[[nodiscard]] bool is_recording(const std::filesystem::path& file);

/// Reads every byte and prints; true when the recording is complete.
bool print_recording(const std::filesystem::path& file, bool as_json);

/// Writes the readable part of `damaged` to `fixed`, which must not exist, and prints a summary.
/// Throws Error{bad_input | write_failed} and leaves no new file.
void recover_recording(const std::filesystem::path& damaged, const std::filesystem::path& fixed, bool as_json);

/// For checksums and sessions.
inline std::string hexadecimal(std::uint64_t number) {
  return formatted("%016llx", static_cast<unsigned long long>(number));
}

/// Strings without quotes and control characters.
inline std::string text(const nlohmann::ordered_json& json) {
  using Json = nlohmann::ordered_json;
  return printable(json.is_string() ? json.get<std::string>()
                                    : json.dump(-1, ' ', false, Json::error_handler_t::replace));
}
inline std::string pretty(const nlohmann::ordered_json& json) {
  return json.dump(2, ' ', false, nlohmann::ordered_json::error_handler_t::replace);
}

}  // namespace lbea::tool
