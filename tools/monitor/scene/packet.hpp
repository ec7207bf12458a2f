// The binary messages for the browser: a JSON head followed by typed arrays.
//
//   bytes 0-3  "LBMO"
//   bytes 4-7  length of the head, u32, little-endian
//   bytes 8-   the head: JSON with "sections": {name: {"type": TYPE, "offset": bytes, "count": n}}, where TYPE
//              is "f32", "u16", "u32" or "u8"
//   then       the sections, from the next multiple of 8 on; offsets count from there and are multiples of 8
#pragma once

#include <nlohmann/json_fwd.hpp>

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace lbea::tool {

class Packet {
 public:
  /// Number: float, std::uint16_t or std::uint32_t.
  template <class Number>
  void add(std::string name, const std::vector<Number>& values) {
    constexpr std::string_view type = std::is_same_v<Number, float> ? "f32" : sizeof(Number) == 2 ? "u16" : "u32";
    const auto bytes = std::as_bytes(std::span(values));
    sections_.push_back({std::move(name), type, {bytes.begin(), bytes.end()}, values.size()});
  }
  /// The packet of each component as section "component0", ..., but for empty ones.
  void add_components(std::span<const std::string> packets);
  /// The packet; adds "sections" to `head`.
  [[nodiscard]] std::string finish(nlohmann::json head) const;

 private:
  struct Section {
    std::string name;
    std::string_view type;
    std::vector<std::byte> bytes;
    std::size_t count = 0;
  };
  std::vector<Section> sections_;
};

}  // namespace lbea::tool
