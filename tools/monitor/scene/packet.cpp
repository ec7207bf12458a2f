#include "tools/monitor/scene/packet.hpp"

#include <nlohmann/json.hpp>

namespace lbea::tool {
namespace {

constexpr std::size_t alignment = 8;

std::size_t aligned(std::size_t bytes) { return (bytes + alignment - 1) / alignment * alignment; }

}  // namespace

void Packet::add_components(std::span<const std::string> packets) {
  for (std::size_t i = 0; i < packets.size(); ++i) {
    const auto bytes = std::as_bytes(std::span(packets[i]));
    if (bytes.empty()) continue;
    sections_.push_back({"component" + std::to_string(i), "u8", {bytes.begin(), bytes.end()}, bytes.size()});
  }
}

std::string Packet::finish(nlohmann::json head) const {
  auto& places = head["sections"] = nlohmann::json::object();
  std::size_t offset = 0;
  for (const Section& section : sections_) {
    places[section.name] = {{"type", section.type}, {"offset", offset}, {"count", section.count}};
    offset += aligned(section.bytes.size());
  }
  const std::string text = head.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
  std::string packet = "LBMO";
  const auto head_bytes = static_cast<std::uint32_t>(text.size());
  packet.append(reinterpret_cast<const char*>(&head_bytes), sizeof head_bytes);
  packet += text;
  packet.resize(aligned(packet.size()));
  for (const Section& section : sections_) {
    packet.append(reinterpret_cast<const char*>(section.bytes.data()), section.bytes.size());
    packet.resize(aligned(packet.size()));
  }
  return packet;
}

}  // namespace lbea::tool
