// Lines and values of a VTK legacy file: text, or binary and big-endian.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace lbea::io::grid {

class VtkTokens {
 public:
  VtkTokens(std::string_view bytes, const std::string& name) : bytes_(bytes), name_(name) {}

  bool is_binary = false;

  /// The next line; false at the end.
  bool line(std::string_view& line) noexcept;
  /// The next line that is not blank, without moving past it; empty at the end.
  [[nodiscard]] std::string_view peek() noexcept;
  /// `count` values of a type as VTK calls it ("float", "vtktypeint64", ...).
  [[nodiscard]] std::vector<double> values(std::uint64_t count, std::string_view type);
  /// The same for indices and counts.
  [[nodiscard]] std::vector<std::uint64_t> indices(std::uint64_t count, std::string_view type);
  void skip_blank_lines() noexcept;
  [[noreturn]] void fail(const std::string& what, bool is_unsupported = false) const;

 private:
  [[nodiscard]] std::vector<double> text_values(std::uint64_t count);

  std::string_view bytes_;
  const std::string& name_;
  std::size_t at_ = 0;
};

}  // namespace lbea::io::grid
