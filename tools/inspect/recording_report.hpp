// Prints the contents of a recording and whether it is complete, and recovers damaged ones.
#pragma once

#include <filesystem>

namespace lbea::tool {

/// Whether the file has the name or the first bytes of a recording (MCAP).
[[nodiscard]] bool is_recording(const std::filesystem::path& file);

/// Reads every byte and prints; true when the recording is complete.
bool print_recording(const std::filesystem::path& file, bool as_json);

/// Writes the readable part of `damaged` to `fixed`, which must not exist, and prints a summary.
/// Throws Error{bad_input | write_failed} and leaves no new file.
void recover_recording(const std::filesystem::path& damaged, const std::filesystem::path& fixed, bool as_json);

}  // namespace lbea::tool
