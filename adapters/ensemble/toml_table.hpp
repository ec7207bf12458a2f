// A TOML table that is read key by key: absent keys leave the default, wrong types and unknown keys are refused.
#pragma once

#include <toml++/toml.h>

#include <array>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

namespace lbea::io {

class TomlTable {
 public:
  /// `table` and `file` must outlive this; `prefix` is what stands before the keys in messages: "region.".
  TomlTable(const toml::table& table, const std::filesystem::path& file, std::string prefix = "");

  /// Each overwrites `into` when the key is there. Throws Error{bad_input} when it has another type.
  void read(const char* key, bool& into);
  void read(const char* key, double& into);         // an integer will do
  void read(const char* key, std::uint32_t& into);  // from 0
  void read(const char* key, std::string& into);
  void read(const char* key, std::vector<std::string>& into);
  void read(const char* key, std::vector<std::uint32_t>& into);
  void read(const char* key, std::array<double, 3>& into);
  void read_path(const char* key, std::filesystem::path& into);  // resolved against the file's folder

  /// The value of a key that may have several types; null when it is absent.
  [[nodiscard]] const toml::node* find(const char* key);
  /// A table below this one; null when the key is absent.
  [[nodiscard]] std::unique_ptr<TomlTable> table(const char* key);
  /// Throws Error{bad_input} for the first key that was never asked for.
  void refuse_unknown_keys() const;

  [[nodiscard]] std::filesystem::path folder() const { return file_.parent_path(); }
  /// Throws Error{bad_input} "file, line: key what".
  [[noreturn]] void fail(const char* key, const std::string& what) const;
  [[noreturn]] void fail_at(const toml::source_region& where, const std::string& what) const;

 private:
  template <class T>
  void read_one(const char* key, T& into, const char* expected);
  template <class T>
  void read_list(const char* key, std::vector<T>& into, const char* expected);

  const toml::table& table_;
  const std::filesystem::path& file_;
  std::string prefix_;
  std::vector<std::string> known_;
};

}  // namespace lbea::io
