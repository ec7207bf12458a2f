// What the browser gets in binary: a JSON head and typed arrays behind it.
//
//   bytes 0-3   "LBMO"
//   bytes 4-7   length of the head, u32, little-endian
//   bytes 8-    the head: JSON with "sections": {name: {"type": "f32" | "u16" | "u32", "offset": bytes, "count":
//   values}} then        the sections, from the next multiple of 8 on; offsets count from there and are divisible by 8
//   too
#pragma once

#include <nlohmann/json_fwd.hpp>

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace lbea::tool {

class Packet {
 public:
  void add(std::string name, std::vector<float> values);
  void add(std::string name, std::vector<std::uint16_t> values);
  void add(std::string name, std::vector<std::uint32_t> values);
  /// Everything; `head` gets its "sections".
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
