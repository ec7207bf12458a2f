// A small HTTP/1.1 and WebSocket server on one thread, with limits on connections, sizes and times. The metrics and
// lbea-monitor use it; each supplies a Handler. Boost stays in server.cpp because Beast is slow to compile.
#pragma once

#include <atomic>
#include <chrono>
#include <cstdint>
#include <functional>
#include <memory>
#include <set>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace lbea::http {

struct Address {
  std::string host;        // numeric, IPv6 without brackets
  std::uint16_t port = 0;  // 0: any free port
  bool is_loopback = false;
};

/// "127.0.0.1:8080", "[::1]:8080", "localhost:8080". `option` is the command-line option that errors name.
/// Throws Error{bad_config}, also for host names other than localhost.
[[nodiscard]] Address parse_address(const std::string& text, const std::string& option);
/// Whether `host` is an IPv4 address or an IPv6 address without brackets.
[[nodiscard]] bool is_numeric_address(const std::string& host);
/// Whether `host` is a numeric address of this machine's loopback interface.
[[nodiscard]] bool is_loopback_address(const std::string& host);
/// The name or address in a Host header, without port and brackets.
[[nodiscard]] std::string_view host_name(std::string_view host) noexcept;
/// "127.0.0.1:8080", "[::1]:8080".
[[nodiscard]] std::string to_string(const Address& address);

/// The parts of a request that decide the response; absent ones are empty. The views are valid during the call.
struct Request {
  std::string_view method, target, host, origin, cookie, authorization;
  std::string_view subprotocols{};  // that a WebSocket client offers, separated by commas
  /// The target without its query.
  [[nodiscard]] std::string_view path() const noexcept { return target.substr(0, target.find('?')); }
};

/// The value of `key` in pairs such as "a=1; b=2"; empty when absent. The first character of `separator` ends a pair.
[[nodiscard]] std::string_view pair_value(std::string_view pairs, std::string_view separator,
                                          std::string_view key) noexcept;
/// The value of `key` in a query or target such as "/?a=1&b=2"; empty when absent. Nothing is unescaped.
[[nodiscard]] std::string_view query_value(std::string_view target, std::string_view key) noexcept;

struct Response {
  unsigned status = 200;
  std::string content_type, body;
  std::vector<std::pair<std::string, std::string>> headers{};
  bool closes_connection = false;
};

enum class MessageType : std::uint8_t { text, binary };

/// An open WebSocket. Use it in the server's thread only.
class WebSocket {
 public:
  virtual ~WebSocket() = default;
  /// Sends `head` and `body` as one message. They must stay valid until the session's sent(); only one send at a time.
  virtual void send(MessageType type, std::string_view head, std::string_view body = {}) = 0;
  /// Closes the connection without a closing handshake.
  virtual void close() = 0;
};

/// One WebSocket connection as its user sees it. The server's thread calls it, and destroys it after the connection.
class WebSocketSession {
 public:
  virtual ~WebSocketSession() = default;
  /// The handshake is complete. `socket` lives as long as the session.
  virtual void opened(WebSocket& socket) = 0;
  virtual void received(std::string_view message) = 0;
  /// The last message was sent and the connection is still open.
  virtual void sent() = 0;
};

/// The open sessions of one kind. The server's thread uses the set; any thread may read the count.
template <class Session>
struct OpenSessions {
  void add(Session* session) {
    all.insert(session);
    ++count;
  }
  void remove(Session* session) {
    all.erase(session);
    --count;
  }
  std::set<Session*> all;
  std::atomic<std::size_t> count{0};
};

/// The answer to a request for a WebSocket: a session, or a response that refuses it.
struct Upgrade {
  std::unique_ptr<WebSocketSession> session;  // null: refused
  Response refusal{};
  std::string subprotocol{};  // empty: none
  std::size_t largest_message = 1024;
  int send_buffer_bytes = 0;  // of the system; 0: its default
};

/// Answers requests. The server's thread calls it; it must not throw.
class Handler {
 public:
  virtual ~Handler() = default;
  [[nodiscard]] virtual Response respond(const Request& request) = 0;
  /// Called for requests for a WebSocket. By default they are answered like any other request.
  [[nodiscard]] virtual Upgrade upgrade(const Request& request) { return {nullptr, respond(request)}; }
};

struct Limits {
  std::size_t connections = 16;      // at a time; a further one replaces one that has sent no request
  std::size_t request_bytes = 8192;  // of a request's header; bodies are not accepted
  std::chrono::milliseconds request_timeout{5000};
  std::chrono::milliseconds response_timeout{0};  // 0: request_timeout includes the response
  std::chrono::milliseconds silence{20'000};      // a WebSocket client that answers no ping for this long is closed
};

class Server {
 public:
  /// Binds the address. `name` is the Server header of WebSocket handshakes. Throws Error{endpoint_unavailable}.
  Server(const Address& address, Limits limits, std::string name = {});
  /// Stops, then destroys all sessions.
  ~Server();
  Server(const Server&) = delete;
  Server& operator=(const Server&) = delete;
  /// Serves in a thread of its own. `handler` must outlive the server.
  void start(Handler& handler);
  /// As bound, with the number of the port.
  [[nodiscard]] const Address& address() const noexcept;
  /// Runs `task` in the server's thread. Any thread.
  void post(std::function<void()> task);

 private:
  struct State;
  std::unique_ptr<State> state_;
};

/// Parses `bytes` as the server does and calls `use` with the request. False when they are not one complete request
/// within `request_bytes`. For tests.
bool read_request(std::string_view bytes, std::size_t request_bytes, const std::function<void(const Request&)>& use);

}  // namespace lbea::http
