// Reads little-endian numbers, strings and blocks one after another and never beyond the end.
#pragma once

#include <bit>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <span>
#include <string_view>

namespace lbea::mcap {

using Bytes = std::span<const std::byte>;

static_assert(std::endian::native == std::endian::little, "numbers are copied as they lie in the file");

/// Failure sticks: after reading past the end everything is zero or empty and intact() is false.
class ByteCursor {
 public:
  explicit ByteCursor(Bytes rest) : rest_(rest) {}

  template <class Number>
  Number number() {
    Number value = 0;
    const Bytes bytes = block(sizeof value);
    if (!bytes.empty()) std::memcpy(&value, bytes.data(), sizeof value);
    return value;
  }
  Bytes block(std::uint64_t length) {
    if (length > rest_.size()) {
      intact_ = false;
      rest_ = {};
      return {};
    }
    const Bytes bytes = rest_.first(static_cast<std::size_t>(length));
    rest_ = rest_.subspan(bytes.size());
    return bytes;
  }
  /// Preceded by its length as u32.
  Bytes short_block() { return block(number<std::uint32_t>()); }
  /// Preceded by its length as u64.
  Bytes long_block() { return block(number<std::uint64_t>()); }
  std::string_view text() {
    const Bytes bytes = short_block();
    return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
  }

  [[nodiscard]] bool intact() const { return intact_; }
  [[nodiscard]] bool at_end() const { return rest_.empty(); }
  void fail() { intact_ = false; }

 private:
  Bytes rest_;
  bool intact_ = true;
};

}  // namespace lbea::mcap
