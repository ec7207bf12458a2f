// Results that the monitor shows, and the packets that it sends.
#pragma once

#include "adapters/wire/codec/messages.hpp"

#include <doctest/doctest.h>
#include <nlohmann/json.hpp>

#include <cstring>
#include <string>
#include <vector>

namespace lbea::test {

inline wire::WireResult result_of(std::uint64_t id, std::uint64_t session = 1) {
  wire::WireResult result;
  result.sequence = id;
  result.session = session;
  result.frame_id = id;
  result.stamp_ns = 1'000'000'000 + static_cast<std::int64_t>(id) * 1'000'000;
  result.verdict = wire::WireVerdict::matched;
  result.coverage = 0.5f;
  result.matches = {{{2, 7}, "run \"b\"", 0.007, 1.5f}};
  result.leading_coordinates = {1, 2, static_cast<float>(id)};
  result.elapsed_ns.total = 2'000'000;
  return result;
}

struct ReadPacket {
  nlohmann::json head;
  std::string bytes;
  std::size_t begin;
  template <class T>
  std::vector<T> section(const std::string& name) const {
    const auto& place = head["sections"][name];
    std::vector<T> values(place["count"].get<std::size_t>());
    if (!values.empty())
      std::memcpy(values.data(), bytes.data() + begin + place["offset"].get<std::size_t>(), values.size() * sizeof(T));
    return values;
  }
};

inline ReadPacket read(const std::string& packet) {
  std::uint32_t length = 0;
  REQUIRE(packet.substr(0, 4) == "LBMO");
  std::memcpy(&length, packet.data() + 4, 4);
  return {nlohmann::json::parse(packet.substr(8, length)), packet, (8 + length + 7) / 8 * std::size_t{8}};
}

}  // namespace lbea::test
