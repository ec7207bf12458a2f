// A TOML file that is read key by key: absent keys keep the default, wrong types and unknown keys are refused.
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

namespace lbea::io {
/// A whole number from 0, or three finite numbers.
using NumberOrPlace = std::variant<std::uint32_t, std::array<double, 3>>;

class TomlTable {
 public:
  /// The top table of a file. Throws Error{file_not_found | bad_input}.
  explicit TomlTable(const std::filesystem::path& file);
  ~TomlTable();
  TomlTable(TomlTable&&) noexcept;

  /// Each overwrites `into` when the key is there. Throws Error{bad_input} when its value has another type.
  void read(const char* key, bool& into);
  void read(const char* key, double& into);         // an integer is converted
  void read(const char* key, std::uint32_t& into);  // from 0
  void read(const char* key, std::string& into);
  void read(const char* key, std::vector<std::string>& into);
  void read(const char* key, std::vector<std::uint32_t>& into);
  void read(const char* key, std::array<double, 3>& into);
  void read(const char* key, std::vector<NumberOrPlace>& into);                 // [4711, [0.5, 1, 2]]
  void read(const char* key, std::vector<std::array<std::uint32_t, 2>>& into);  // {101 = 1, 102 = 2}
  void read_path(const char* key, std::filesystem::path& into);                 // resolved against the file's folder

  /// For keys whose value may have several types.
  [[nodiscard]] bool has(const char* key);
  [[nodiscard]] bool is_list(const char* key);
  [[nodiscard]] bool is_text(const char* key);
  /// A table below this one; null when the key is absent.
  [[nodiscard]] std::unique_ptr<TomlTable> table(const char* key);
  /// A list of tables, [[key]]; empty when the key is absent.
  [[nodiscard]] std::vector<TomlTable> tables(const char* key);
  /// Throws Error{bad_input} for the first key that was never read or asked for.
  void refuse_unknown_keys() const;

  [[nodiscard]] std::filesystem::path folder() const;
  /// Throws Error{bad_input} "file, line: key what".
  [[noreturn]] void fail(const char* key, const std::string& what) const;

 private:
  struct Node;
  explicit TomlTable(Node node);

  std::unique_ptr<Node> node_;
};

/// "; did you mean \"modes\"?", or the list of known words when none is near.
[[nodiscard]] std::string suggestion(std::string_view word, std::span<const std::string> known);

/// The least number of letters inserted, removed or replaced that turns `a` into `b`.
[[nodiscard]] std::size_t edit_distance(std::string_view a, std::string_view b);
}  // namespace lbea::io
