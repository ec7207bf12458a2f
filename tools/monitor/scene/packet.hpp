// The binary messages for the browser: a JSON head followed by typed arrays.
//
//   bytes 0-3  "LBMO"
//   bytes 4-7  length of the head, u32, little-endian
//   bytes 8-   the head: JSON with "sections": {name: {"type": "f32" | "u16" | "u32", "offset": bytes, "count": n}}
//   then       the sections, from the next multiple of 8 on; offsets count from there and are multiples of 8
#pragma once

#include <nlohmann/json_fwd.hpp>

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace lbea::tool {

class Packet {
 public:
  void add(std::string name, std::vector<float> values);
  void add(std::string name, std::vector<std::uint16_t> values);
  void add(std::string name, std::vector<std::uint32_t> values);
  /// The packet; adds "sections" to `head`.
  [[nodiscard]] std::string finish(nlohmann::json head) const;

 private:
  struct Section {
    std::string name;
    std::string_view type;
    std::vector<std::byte> bytes;
    std::size_t count = 0;
  };
  template <class T>
  void add_values(std::string name, std::string_view type, const std::vector<T>& values);
  std::vector<Section> sections_;
};

}  // namespace lbea::tool
