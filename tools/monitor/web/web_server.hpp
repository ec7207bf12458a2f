// HTTP and WebSocket, on one thread. Reads only what a browser must say to be served; whoever is slow gets fewer
// snapshots, whoever stalls is let go.
#pragma once

#include "tools/monitor/feeds/feed.hpp"
#include "tools/monitor/web/access.hpp"
#include "tools/monitor/web/assets.hpp"
#include "tools/monitor/web/foxglove.hpp"

#include <chrono>
#include <memory>

namespace lbea::tool {

struct WebLimits {
  std::size_t connections = 128;  // at a time; more are closed at once
  std::size_t watchers = 64;      // WebSockets among them; more are refused in words
  std::chrono::seconds request_timeout{10};
  std::chrono::seconds silence{20};  // a browser that does not even answer a ping is let go
};

struct WebConfig {
  HttpAddress address;
  std::vector<std::string> allowed_names;
  std::string token;
  WebLimits limits;
  bool has_viewers = false;                   // whether Foxglove's protocol is spoken, on the same port
  std::vector<std::string> viewer_origins{};  // pages of other sites whose viewers may connect
};

class WebServer {
 public:
  /// Binds and serves. Throws Error{endpoint_unavailable | bad_config}.
  WebServer(const WebConfig& config, Assets assets, Feed& feed);
  ~WebServer();
  WebServer(const WebServer&) = delete;
  WebServer& operator=(const WebServer&) = delete;

  /// What to open in a browser, with the token.
  [[nodiscard]] std::string url() const;
  [[nodiscard]] std::uint16_t port() const noexcept;
  // Any thread:
  void publish(Snapshot snapshot);
  [[nodiscard]] std::size_t watchers() const noexcept;
  /// Whether a snapshot would go out at once: somebody watches who has taken all there was so far.
  [[nodiscard]] bool is_awaited() const noexcept;
  /// To the viewers that subscribed to its channel. Never waits: what the server's thread is too slow for is left out.
  void relay(ViewerMessage message);
  [[nodiscard]] std::size_t viewers() const noexcept;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace lbea::tool
