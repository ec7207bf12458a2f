#include "tools/monitor/web/foxglove.hpp"

#include "adapters/wire/codec/schemas.hpp"
#include "tools/shared/recording/topics.hpp"

#include <boost/archive/iterators/base64_from_binary.hpp>
#include <boost/archive/iterators/transform_width.hpp>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <limits>
#include <span>

namespace lbea::tool {
namespace {

using nlohmann::json;

constexpr std::array<std::string_view, 2> spoken{"foxglove.sdk.v1", "foxglove.websocket.v1"};
constexpr char message_data = 1;  // opcode

std::string base64(std::span<const std::byte> bytes) {
  using namespace boost::archive::iterators;
  using Digits = base64_from_binary<transform_width<const char*, 6, 8>>;
  const char* begin = reinterpret_cast<const char*>(bytes.data());
  std::string text(Digits(begin), Digits(begin + bytes.size()));
  text.append((3 - bytes.size() % 3) % 3, '=');
  return text;
}

json channel(ViewerChannel id, std::string_view topic, std::string_view schema_name,
             std::span<const std::byte> schema) {
  return {{"id", static_cast<std::uint32_t>(id)},
          {"topic", topic},
          {"encoding", "flatbuffer"},
          {"schemaName", schema_name},
          {"schema", base64(schema)},
          {"schemaEncoding", "flatbuffer"}};
}

std::string_view trimmed(std::string_view text) {
  while (!text.empty() && text.front() == ' ') text.remove_prefix(1);
  while (!text.empty() && text.back() == ' ') text.remove_suffix(1);
  return text;
}

/// A number as the protocol has them, or nothing.
std::optional<std::uint32_t> number(const json& value) {
  if (!value.is_number_unsigned() || value.get<std::uint64_t>() > std::numeric_limits<std::uint32_t>::max()) return {};
  return value.get<std::uint32_t>();
}

const json& member(const json& object, const char* name) {
  static const json nothing;
  if (!object.is_object()) return nothing;
  const auto found = object.find(name);
  return found == object.end() ? nothing : *found;
}

}  // namespace

std::string_view viewer_subprotocol(std::string_view offered) noexcept {
  for (const std::string_view ours : spoken)
    for (std::string_view rest = offered; !rest.empty();) {
      const std::size_t end = std::min(rest.find(','), rest.size());
      if (trimmed(rest.substr(0, end)) == ours) return ours;
      rest.remove_prefix(std::min(end + 1, rest.size()));
    }
  return {};
}

std::array<std::string, 2> viewer_greeting(std::string_view session) {
  const json info{{"op", "serverInfo"},
                  {"name", "lbea-monitor"},
                  {"capabilities", json::array()},
                  {"supportedEncodings", json::array()},
                  {"metadata", json::object()},
                  {"sessionId", session}};
  const json channels{{"op", "advertise"},
                      {"channels",
                       {channel(ViewerChannel::frames, frames_topic, "foxglove.PointCloud", wire::point_cloud_schema()),
                        channel(ViewerChannel::results, results_topic, "lbea.wire.Result", wire::result_schema()),
                        channel(ViewerChannel::state, state_topic, "lbea.wire.State", wire::state_schema())}}};
  return {info.dump(), channels.dump()};
}

std::array<char, viewer_head_bytes> viewer_head(std::uint32_t subscription, std::int64_t time_ns) noexcept {
  std::array<char, viewer_head_bytes> head{message_data};
  for (std::size_t i = 0; i < 4; ++i) head[1 + i] = static_cast<char>(subscription >> (8 * i));
  for (std::size_t i = 0; i < 8; ++i) head[5 + i] = static_cast<char>(static_cast<std::uint64_t>(time_ns) >> (8 * i));
  return head;
}

std::string viewer_notice(ViewerNotice level, std::string_view sentence) {
  return json{{"op", "status"}, {"level", static_cast<unsigned>(level)}, {"message", sentence}}.dump(
      -1, ' ', false, json::error_handler_t::replace);
}

std::string ViewerSubscriptions::take(std::string_view text) {
  const json said = json::parse(text, nullptr, false);
  const json &op = member(said, "op"), &wanted = member(said, "subscriptions"),
             &unwanted = member(said, "subscriptionIds");
  if (!op.is_string()) return "This is no JSON object with an op.";
  std::string complaint;
  if (op == "subscribe" && wanted.is_array()) {
    for (const json& subscription : wanted) {
      const auto id = number(member(subscription, "id")), channel_id = number(member(subscription, "channelId"));
      const std::string wrong =
          id && channel_id ? subscribe(*id, *channel_id) : "A subscription needs the numbers id and channelId.";
      if (!wrong.empty()) complaint = wrong;
    }
    return complaint;
  }
  if (op == "unsubscribe" && unwanted.is_array()) {
    for (const json& entry : unwanted) {
      const auto id = number(entry);
      const std::string wrong = id ? unsubscribe(*id) : "Subscriptions are named by numbers.";
      if (!wrong.empty()) complaint = wrong;
    }
    return complaint;
  }
  return "Only subscribe and unsubscribe are understood here: this server has no other capabilities.";
}

std::string ViewerSubscriptions::subscribe(std::uint32_t number, std::uint32_t channel) {
  if (channel >= viewer_channels) return "There is no channel of that number.";
  if (std::ranges::find(numbers_, std::optional(number)) != numbers_.end())
    return "That subscription's number is in use.";
  if (numbers_[channel]) return "That channel is subscribed to already.";
  numbers_[channel] = number;
  return {};
}

std::string ViewerSubscriptions::unsubscribe(std::uint32_t number) {
  const auto found = std::ranges::find(numbers_, std::optional(number));
  if (found == numbers_.end()) return "There is no subscription of that number.";
  found->reset();
  return {};
}

}  // namespace lbea::tool
