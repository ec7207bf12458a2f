// The runs an ensemble consists of, from paths and patterns.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace lbea::io {

/// Paths in `folder` that `pattern` (with * ? []) stands for, in the order of their names. A pattern without
/// these signs stands for itself when it exists.
[[nodiscard]] std::vector<std::filesystem::path> matching_paths(const std::filesystem::path& folder,
                                                                const std::string& pattern);

/// Whether `name`, a path below `folder` or a run's name, or a pattern of either, means `run`.
[[nodiscard]] bool means_run(const std::string& name, const std::filesystem::path& folder,
                             const std::filesystem::path& run);

}  // namespace lbea::io
