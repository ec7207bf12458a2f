// Key files as text. Only the .cpp files of this library include it.
#pragma once

#include <filesystem>
#include <string>

namespace lbea::wire {
inline constexpr std::size_t max_key_file_bytes = 1 << 20;
inline constexpr const char* secret_kind = "lbea-secret-key";
inline constexpr const char* public_kind = "lbea-public-key";

/// Throws Error{bad_config} "FILE: WHY".
[[noreturn]] void refuse_key_file(const std::filesystem::path& file, const std::string& why);
/// Throws Error{bad_config} for a text that cannot be a key file's.
void check_key_text(const std::filesystem::path& file, const std::string& text, bool is_secret);

/// Throws Error{file_not_found | bad_config}, also when other users may read a secret key or anybody may change public
/// ones.
[[nodiscard]] std::string read_key_file(const std::filesystem::path& file, bool is_secret);

/// Writes a new file to the disk, a secret one for its user alone. Throws Error{write_failed}, also when it exists.
void write_key_file(const std::filesystem::path& file, const std::string& text, bool is_secret);
}  // namespace lbea::wire
