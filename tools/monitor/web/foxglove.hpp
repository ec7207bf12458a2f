// The Foxglove WebSocket protocol, version 1 (github.com/foxglove/ws-protocol, docs/spec.md): its messages, and the
// session of one viewer.
#pragma once

#include "adapters/http/server.hpp"

#include <array>
#include <deque>
#include <optional>

namespace lbea::tool {

enum class ViewerChannel : std::uint32_t { frames, results, state };
inline constexpr std::size_t viewer_channels = 3;

/// A message in the encoding of the wire: a foxglove.PointCloud, a Result or a State.
struct ViewerMessage {
  ViewerChannel channel = ViewerChannel::results;
  std::int64_t time_ns = 0;  // since 1970
  std::string payload;
};

/// The first supported one of the offered subprotocols, which are separated by commas; empty when there is none.
[[nodiscard]] std::string_view viewer_subprotocol(std::string_view offered) noexcept;

/// Server info and channels, in the order in which a new viewer gets them. By `session` a viewer recognizes a server
/// that it was connected to before.
[[nodiscard]] std::array<std::string, 2> viewer_greeting(std::string_view session);

/// The header of a message: opcode, subscription, time.
inline constexpr std::size_t viewer_head_bytes = 13;
[[nodiscard]] std::array<char, viewer_head_bytes> viewer_head(std::uint32_t subscription,
                                                              std::int64_t time_ns) noexcept;

enum class ViewerNotice : std::uint8_t { info, warning, error };
[[nodiscard]] std::string viewer_notice(ViewerNotice level, std::string_view sentence);

/// The channels that a viewer subscribed to, with the subscription numbers that it chose.
class ViewerSubscriptions {
 public:
  /// Applies a message of the viewer. Returns a sentence that says what is wrong with it; empty when it is valid.
  [[nodiscard]] std::string apply(std::string_view text);
  [[nodiscard]] std::optional<std::uint32_t> number_of(ViewerChannel channel) const noexcept {
    return numbers_[static_cast<std::size_t>(channel)];
  }

 private:
  [[nodiscard]] std::string subscribe(std::uint32_t number, std::uint32_t channel);
  [[nodiscard]] std::string unsubscribe(std::uint32_t number);
  std::array<std::optional<std::uint32_t>, viewer_channels> numbers_;
};

/// Sends a viewer the channels that it subscribed to. When it reads too slowly, the oldest messages are dropped and it
/// is told how many.
class Viewer final : public http::WebSocketSession {
 public:
  static constexpr std::size_t largest_message = 16 * 1024;  // from the viewer
  Viewer(http::OpenSessions<Viewer>& viewers, std::string_view session);
  ~Viewer() override;
  void opened(http::WebSocket& socket) override;
  void received(std::string_view message) override;
  void sent() override;
  void offer(const std::shared_ptr<const ViewerMessage>& message);

 private:
  void drop_oldest(ViewerChannel channel);
  void send_next();
  void send_text(std::string text);
  void send_message(std::uint32_t subscription);
  http::OpenSessions<Viewer>& viewers_;
  http::WebSocket* socket_ = nullptr;
  ViewerSubscriptions subscriptions_;
  std::deque<std::string> greeting_;
  std::string error_;  // the latest one: a viewer that sends faster than it reads gets one reply for several messages
  std::deque<std::shared_ptr<const ViewerMessage>> waiting_;
  std::array<std::size_t, viewer_channels> waiting_in_{};  // by channel
  std::uint64_t dropped_ = 0;
  unsigned errors_ = 0;
  // In flight:
  std::string text_;
  std::array<char, viewer_head_bytes> head_{};
  std::shared_ptr<const ViewerMessage> message_;
  bool is_sending_ = false;
};

}  // namespace lbea::tool
