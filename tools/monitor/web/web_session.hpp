// One connection. Only the web server's own files include this: Beast is large.
#pragma once

#include "tools/monitor/feeds/feed.hpp"
#include "tools/monitor/web/access.hpp"
#include "tools/monitor/web/assets.hpp"
#include "tools/monitor/web/web_server.hpp"

#include <boost/beast/core.hpp>
#include <boost/beast/http.hpp>
#include <boost/beast/websocket.hpp>

#include <atomic>
#include <mutex>
#include <optional>
#include <set>

namespace lbea::tool::web {

namespace beast = boost::beast;
namespace http = beast::http;
namespace websocket = beast::websocket;
using tcp = boost::asio::ip::tcp;

class Watcher;
class Viewer;

/// What all connections share. Its thread's, but for the atomics and what the mutex guards.
struct Shared {
  AccessRules rules;
  Assets assets;
  Feed& feed;
  WebLimits limits;
  bool has_viewers = false;  // Foxglove's protocol is spoken
  std::string session;       // tells viewers this server from one before it
  std::atomic<std::size_t> connections{0}, watching{0}, viewing{0};
  std::atomic<std::size_t> ready{0};  // of those watching: have taken all they were sent
  std::set<Watcher*> watchers;
  std::set<Viewer*> viewers;
  Snapshot latest;
};

/// Counts a connection for as long as it lives.
class Seat {
 public:
  explicit Seat(std::atomic<std::size_t>& count) : count_(&count) { ++count; }
  Seat(Seat&& other) noexcept : count_(std::exchange(other.count_, nullptr)) {}
  Seat& operator=(Seat&&) = delete;
  ~Seat() {
    if (count_ != nullptr) --*count_;
  }

 private:
  std::atomic<std::size_t>* count_;
};

using Request = http::request<http::empty_body>;
using Response = http::response<http::string_body>;

[[nodiscard]] RequestHead head_of(const Request& request);
/// The answer to anything that is not a WebSocket.
[[nodiscard]] Response respond(Shared& shared, const Request& request);
/// Why this WebSocket of our page is not accepted; nothing when it is.
[[nodiscard]] std::optional<Response> refuse_watcher(Shared& shared, const Request& request);
/// The same for a viewer that speaks Foxglove's protocol.
[[nodiscard]] std::optional<Response> refuse_viewer(Shared& shared, const Request& request);

/// Reads requests from a connection until it closes or becomes a WebSocket.
class Conversation : public std::enable_shared_from_this<Conversation> {
 public:
  Conversation(tcp::socket socket, Shared& shared);
  void read();

 private:
  void answer();
  void upgrade(const Request& request);
  void send(Response response);
  beast::tcp_stream stream_;
  Shared& shared_;
  Seat seat_;
  beast::flat_buffer buffer_;
  std::optional<http::request_parser<http::empty_body>> parser_;
  std::optional<Response> response_;
};

/// A browser that watches: gets the latest snapshot whenever it has taken the one before, and the curves' new rows.
class Watcher : public std::enable_shared_from_this<Watcher> {
 public:
  Watcher(beast::tcp_stream stream, Shared& shared, Seat seat);
  ~Watcher();
  void accept(const Request& request);
  /// There is something new.
  void wake();

 private:
  void read();
  void write_next();
  void write(Snapshot message);
  websocket::stream<beast::tcp_stream> stream_;
  Shared& shared_;
  Seat connection_, watching_;
  std::optional<Seat> ready_;  // while there is nothing on its way
  beast::flat_buffer buffer_;
  Snapshot sent_, in_flight_;
  LogCursor cursor_;
  bool open_ = false, rows_turn_ = false;
  bool rows_due_ = true;  // rows go out with snapshots: one by one they would drown the page
};

}  // namespace lbea::tool::web
