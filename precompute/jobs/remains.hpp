// What bakes leave beside a model when they are killed: temporary files and work folders, cleared away by the next one.
#pragma once

#include <filesystem>
#include <optional>
#include <string>

namespace lbea::bake {

/// `kind`PID-`number`: behind a model's name, that of something temporary of this process.
[[nodiscard]] std::string temporary_suffix(const char* kind, int number);
inline constexpr const char* temporary_file = ".tmp-";
inline constexpr const char* temporary_folder = ".tmp-work-";

/// Whoever owns something temporary holds this on its descriptor; it ends with the process, however that ends.
/// False where the file system knows no locks.
bool claim(int descriptor) noexcept;

/// Whether nobody holds the claim of what stands at `path`; nothing where that cannot be told.
[[nodiscard]] std::optional<bool> is_abandoned(const std::filesystem::path& path) noexcept;
/// Whether a process on this machine has the number.
[[nodiscard]] bool is_alive(int process) noexcept;

/// Removes `path` with all in it. Takes no memory: it is called when there is none.
void remove_all_of(const std::filesystem::path& path) noexcept;

/// Removes what bakes of `model` left behind whose process is gone: no process has its number here, and nobody anywhere
/// holds its claim. What is not certain to be such a remainder stays.
void clear_remains(const std::filesystem::path& model);

}  // namespace lbea::bake
