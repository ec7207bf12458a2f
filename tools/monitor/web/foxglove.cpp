#include "tools/monitor/web/foxglove.hpp"

#include "adapters/wire/codec/codec.hpp"
#include "tools/shared/recording/recording_format.hpp"

#include <boost/archive/iterators/base64_from_binary.hpp>
#include <boost/archive/iterators/transform_width.hpp>
#include <nlohmann/json.hpp>

#include <algorithm>

namespace lbea::tool {
namespace {

using nlohmann::json;

constexpr std::array<std::string_view, 2> supported{"foxglove.sdk.v1", "foxglove.websocket.v1"};
constexpr char message_data = 1;       // opcode
constexpr unsigned most_errors = 100;  // of one viewer; then it is disconnected
/// By channel. Stalled viewers share the messages, so memory does not grow with their number.
constexpr std::array<std::size_t, viewer_channels> most_waiting{2, 1024, 2};

std::size_t index_of(ViewerChannel channel) { return static_cast<std::size_t>(channel); }

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

/// An unsigned 32-bit number, or nothing.
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
  for (const std::string_view ours : supported)
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

std::string ViewerSubscriptions::apply(std::string_view text) {
  const json message = json::parse(text, nullptr, false);
  const json &op = member(message, "op"), &added = member(message, "subscriptions"),
             &removed = member(message, "subscriptionIds");
  if (!op.is_string()) return "The message is not a JSON object with an op.";
  std::string problem;
  if (op == "subscribe" && added.is_array()) {
    for (const json& subscription : added) {
      const auto id = number(member(subscription, "id")), channel_id = number(member(subscription, "channelId"));
      const std::string wrong =
          id && channel_id ? subscribe(*id, *channel_id) : "A subscription needs the numbers id and channelId.";
      if (!wrong.empty()) problem = wrong;
    }
    return problem;
  }
  if (op == "unsubscribe" && removed.is_array()) {
    for (const json& entry : removed) {
      const auto id = number(entry);
      const std::string wrong = id ? unsubscribe(*id) : "A subscription is identified by a number.";
      if (!wrong.empty()) problem = wrong;
    }
    return problem;
  }
  return "This server supports only subscribe and unsubscribe; it has no other capabilities.";
}

std::string ViewerSubscriptions::subscribe(std::uint32_t number, std::uint32_t channel) {
  if (channel >= viewer_channels) return "There is no channel with that number.";
  if (std::ranges::find(numbers_, std::optional(number)) != numbers_.end())
    return "That subscription number is in use.";
  if (numbers_[channel]) return "That channel has a subscription already.";
  numbers_[channel] = number;
  return {};
}

std::string ViewerSubscriptions::unsubscribe(std::uint32_t number) {
  const auto found = std::ranges::find(numbers_, std::optional(number));
  if (found == numbers_.end()) return "There is no subscription with that number.";
  found->reset();
  return {};
}

Viewer::Viewer(http::OpenSessions<Viewer>& viewers, std::string_view session) : viewers_(viewers) {
  for (std::string& text : viewer_greeting(session)) greeting_.push_back(std::move(text));
  viewers_.add(this);
}

Viewer::~Viewer() { viewers_.remove(this); }

void Viewer::opened(http::WebSocket& socket) {
  socket_ = &socket;
  send_next();
}

void Viewer::received(std::string_view message) {
  error_ = subscriptions_.apply(message);
  if (!error_.empty() && ++errors_ > most_errors) return socket_->close();
  if (!is_sending_) send_next();
}

void Viewer::offer(const std::shared_ptr<const ViewerMessage>& message) {
  if (!subscriptions_.number_of(message->channel)) return;
  std::size_t& waiting = waiting_in_[index_of(message->channel)];
  if (waiting == most_waiting[index_of(message->channel)]) drop_oldest(message->channel);
  waiting_.push_back(message);
  ++waiting;
  if (!is_sending_) send_next();
}

void Viewer::drop_oldest(ViewerChannel channel) {
  waiting_.erase(std::ranges::find_if(waiting_, [&](const auto& message) { return message->channel == channel; }));
  --waiting_in_[index_of(channel)];
  ++dropped_;
}

void Viewer::send_next() {
  if (!greeting_.empty()) {
    std::string text = std::move(greeting_.front());
    greeting_.pop_front();
    return send_text(std::move(text));
  }
  if (!error_.empty()) return send_text(viewer_notice(ViewerNotice::error, std::exchange(error_, {})));
  if (dropped_ > 0)
    return send_text(viewer_notice(
        ViewerNotice::warning,
        std::to_string(std::exchange(dropped_, 0)) + " messages were dropped because this viewer reads too slowly."));
  while (!waiting_.empty()) {
    message_ = std::move(waiting_.front());
    waiting_.pop_front();
    --waiting_in_[index_of(message_->channel)];
    if (const auto subscription = subscriptions_.number_of(message_->channel)) return send_message(*subscription);
  }
  message_.reset();
}

void Viewer::send_text(std::string text) {
  is_sending_ = true;
  text_ = std::move(text);
  socket_->send(http::MessageType::text, text_);
}

void Viewer::send_message(std::uint32_t subscription) {
  is_sending_ = true;
  head_ = viewer_head(subscription, message_->time_ns);
  socket_->send(http::MessageType::binary, {head_.data(), head_.size()}, message_->payload);
}

void Viewer::sent() {
  is_sending_ = false;
  message_.reset();
  send_next();
}

}  // namespace lbea::tool
