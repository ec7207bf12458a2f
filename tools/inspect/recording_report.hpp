// What is inside a recording, whether it is complete, and how to make a whole one of a broken one.
#pragma once

#include <filesystem>

namespace lbea::tool {

/// Whether the file is called or begins like a recording (MCAP).
[[nodiscard]] bool is_recording(const std::filesystem::path& file);

/// Reads every byte and prints; true when the recording is complete.
bool print_recording(const std::filesystem::path& file, bool as_json);

/// Writes what can be read of `damaged` to `fixed`, which must not exist, and prints what that is.
/// Throws Error{bad_input | write_failed}; then there is no new file.
void recover_recording(const std::filesystem::path& damaged, const std::filesystem::path& fixed, bool as_json);

}  // namespace lbea::tool
