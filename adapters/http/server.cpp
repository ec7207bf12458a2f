#include "adapters/http/server.hpp"

#include <lbea/lbea.hpp>

#include <algorithm>
#include <list>
#include <map>
#include <optional>
#include <thread>

#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/post.hpp>
#include <boost/asio/steady_timer.hpp>
#include <boost/beast/core.hpp>
#include <boost/beast/http.hpp>
#include <boost/beast/websocket.hpp>

namespace lbea::http {
namespace {
using namespace std::chrono_literals;
namespace asio = boost::asio;
namespace beast = boost::beast;
namespace websocket = beast::websocket;
using tcp = asio::ip::tcp;
using Parser = beast::http::request_parser<beast::http::empty_body>;
using ParsedRequest = Parser::value_type;
using StringResponse = beast::http::response<beast::http::string_body>;
using Field = beast::http::field;

constexpr auto handshake_timeout = 5s;
constexpr auto accept_pause = 100ms;  // after a failed accept, for example when descriptors have run out
#ifdef _WIN32
constexpr bool reuses_address = false;  // SO_REUSEADDR would let a second program take the port over
#else
constexpr bool reuses_address = true;  // after the end of an earlier program
#endif

std::string_view to_std(beast::string_view text) { return {text.data(), text.size()}; }

void set_limits(Parser& parser, std::size_t request_bytes) {
  parser.header_limit(static_cast<std::uint32_t>(request_bytes));
  parser.body_limit(0);
}

Request request_of(const ParsedRequest& parsed) {
  const auto field = [&](Field name) { return to_std(parsed[name]); };
  return {to_std(parsed.method_string()),
          to_std(parsed.target()),
          field(Field::host),
          field(Field::origin),
          field(Field::cookie),
          field(Field::authorization),
          field(Field::sec_websocket_protocol)};
}

StringResponse to_beast(const ParsedRequest& request, Response answer) {
  StringResponse response{static_cast<beast::http::status>(answer.status), request.version()};
  response.set(Field::content_type, answer.content_type);
  for (const auto& [name, value] : answer.headers) response.set(name, value);
  response.keep_alive(request.keep_alive() && !answer.closes_connection);
  response.body() = std::move(answer.body);
  response.prepare_payload();
  if (request.method() == beast::http::verb::head) response.body().clear();
  return response;
}

class Connection;

/// State that all connections share. Only the server's thread uses it.
struct Shared {
  Limits limits;
  std::string name;
  Handler* handler = nullptr;
  std::size_t connections = 0;
  std::list<Connection*> waiting{};  // for a request, the longest first

  /// Whether another connection may be accepted. If there are too many, the address with the most waiting connections
  /// loses the one that waits longest: clients that send no request cannot keep others out.
  [[nodiscard]] bool make_room();
};

/// Counts a connection for as long as it exists.
class ConnectionCount {
 public:
  explicit ConnectionCount(std::size_t& count) : count_(&count) { ++count; }
  ConnectionCount(ConnectionCount&& other) noexcept : count_(std::exchange(other.count_, nullptr)) {}
  ConnectionCount& operator=(ConnectionCount&&) = delete;
  ~ConnectionCount() {
    if (count_ != nullptr) --*count_;
  }

 private:
  std::size_t* count_;
};

/// A connection after its upgrade. Pending operations own it.
class WebSocketConnection final : public WebSocket, public std::enable_shared_from_this<WebSocketConnection> {
 public:
  WebSocketConnection(beast::tcp_stream stream, ConnectionCount counted, Upgrade upgrade)
      : counted_(std::move(counted)),
        stream_(std::move(stream)),
        buffer_(upgrade.largest_message),
        session_(std::move(upgrade.session)),
        subprotocol_(std::move(upgrade.subprotocol)) {
    stream_.auto_fragment(false);  // otherwise one system call for every 4 kB
    stream_.read_message_max(upgrade.largest_message);
    beast::error_code ignored;
    if (upgrade.send_buffer_bytes > 0)
      beast::get_lowest_layer(stream_).socket().set_option(
          asio::socket_base::send_buffer_size(upgrade.send_buffer_bytes), ignored);
  }

  void accept(const ParsedRequest& request, const Shared& shared) {
    stream_.set_option(websocket::stream_base::timeout{handshake_timeout, shared.limits.silence, true});
    stream_.set_option(websocket::stream_base::decorator(
        [name = shared.name, subprotocol = subprotocol_](websocket::response_type& response) {
          if (!name.empty()) response.set(Field::server, name);
          if (!subprotocol.empty()) response.set(Field::sec_websocket_protocol, subprotocol);
        }));
    stream_.async_accept(request, [self = shared_from_this()](beast::error_code error) {
      if (error) return;
      self->is_open_ = true;
      self->read();
      self->session_->opened(*self);
    });
  }

  void send(MessageType type, std::string_view head, std::string_view body) override {
    stream_.text(type == MessageType::text);
    const std::array<asio::const_buffer, 2> parts{asio::buffer(head.data(), head.size()),
                                                  asio::buffer(body.data(), body.size())};
    stream_.async_write(parts, [self = shared_from_this()](beast::error_code error, std::size_t) {
      if (!error && self->is_open_) self->session_->sent();
    });
  }

  void close() override {
    is_open_ = false;
    beast::get_lowest_layer(stream_).close();
  }

 private:
  void read() {
    stream_.async_read(buffer_, [self = shared_from_this()](beast::error_code error, std::size_t) {
      if (error) {
        self->is_open_ = false;
        return;
      }
      const auto bytes = self->buffer_.cdata();
      self->session_->received({static_cast<const char*>(bytes.data()), bytes.size()});
      self->buffer_.consume(self->buffer_.size());
      if (self->is_open_) self->read();
    });
  }

  ConnectionCount counted_;
  websocket::stream<beast::tcp_stream> stream_;
  beast::flat_buffer buffer_;
  std::unique_ptr<WebSocketSession> session_;
  std::string subprotocol_;
  bool is_open_ = false;
};

/// Reads and answers requests until the connection closes or becomes a WebSocket. Pending operations own it.
class Connection : public std::enable_shared_from_this<Connection> {
 public:
  Connection(tcp::socket socket, Shared& shared)
      : stream_(std::move(socket)), shared_(shared), counted_(shared.connections) {
    beast::error_code ignored;
    address_ = stream_.socket().remote_endpoint(ignored).address();
  }
  ~Connection() { stop_waiting(); }
  Connection(const Connection&) = delete;
  Connection& operator=(const Connection&) = delete;
  [[nodiscard]] const asio::ip::address& address() const noexcept { return address_; }
  void close() {
    stop_waiting();
    stream_.close();
  }
  void read() {
    shared_.waiting.push_back(this);
    set_limits(parser_.emplace(), shared_.limits.request_bytes);
    stream_.expires_after(shared_.limits.request_timeout);
    beast::http::async_read(stream_, buffer_, *parser_,
                            [self = shared_from_this()](beast::error_code error, std::size_t) {
                              if (!error) self->answer();
                            });
  }

 private:
  void stop_waiting() { shared_.waiting.remove(this); }
  void answer() {
    stop_waiting();
    const Request request = request_of(parser_->get());
    if (!websocket::is_upgrade(parser_->get())) return send(shared_.handler->respond(request));
    Upgrade upgrade = shared_.handler->upgrade(request);
    if (upgrade.session == nullptr) return send(std::move(upgrade.refusal));
    stream_.expires_never();
    std::make_shared<WebSocketConnection>(std::move(stream_), std::move(counted_), std::move(upgrade))
        ->accept(parser_->get(), shared_);
  }

  void send(Response response) {
    response_ = to_beast(parser_->get(), std::move(response));
    if (shared_.limits.response_timeout > 0ms) stream_.expires_after(shared_.limits.response_timeout);
    beast::http::async_write(stream_, *response_, [self = shared_from_this()](beast::error_code error, std::size_t) {
      if (!error && self->response_->keep_alive()) return self->read();
      beast::error_code ignored;
      self->stream_.socket().shutdown(tcp::socket::shutdown_both, ignored);
    });
  }

  beast::tcp_stream stream_;
  Shared& shared_;
  ConnectionCount counted_;
  asio::ip::address address_;
  beast::flat_buffer buffer_;
  std::optional<Parser> parser_;
  std::optional<StringResponse> response_;
};

bool Shared::make_room() {
  if (connections < limits.connections) return true;
  std::map<asio::ip::address, std::size_t> counts;
  for (const Connection* connection : waiting) ++counts[connection->address()];
  const auto most = std::ranges::max_element(counts, {}, [](const auto& count) { return count.second; });
  if (most == counts.end()) return false;
  (*std::ranges::find(waiting, most->first, &Connection::address))->close();
  return true;
}

tcp::acceptor bind(asio::io_context& io, const Address& address) {
  const tcp::endpoint endpoint(asio::ip::make_address(address.host), address.port);
  try {
    return {io, endpoint, reuses_address};
  } catch (const boost::system::system_error& error) {
    throw Error(Status::endpoint_unavailable, "cannot serve HTTP on " + to_string(address) + " (" +
                                                  error.code().message() +
                                                  "); stop the program that uses it or choose another port");
  }
}
}  // namespace

bool read_request(std::string_view bytes, std::size_t request_bytes, const std::function<void(const Request&)>& use) {
  Parser parser;
  set_limits(parser, request_bytes);
  parser.eager(true);
  beast::error_code error;
  parser.put(asio::buffer(bytes.data(), bytes.size()), error);
  if (error || !parser.is_done()) return false;
  use(request_of(parser.get()));
  return true;
}

struct Server::State {
  State(const Address& where, Limits limits, std::string name)
      : address(where), shared{limits, std::move(name)}, acceptor(bind(io, where)) {
    address.port = acceptor.local_endpoint().port();
  }

  void accept() {
    acceptor.async_accept([this](beast::error_code error, tcp::socket socket) {
      if (error == asio::error::operation_aborted) return;
      if (!error && shared.make_room()) std::make_shared<Connection>(std::move(socket), shared)->read();
      if (!error) return accept();
      pause.expires_after(accept_pause);
      pause.async_wait([this](beast::error_code stopped) {
        if (!stopped) accept();
      });
    });
  }

  Address address;
  Shared shared;  // outlives the connections, which the pending operations in `io` own
  asio::io_context io{1};
  tcp::acceptor acceptor;
  asio::steady_timer pause{io};
  std::thread thread;
};

Server::Server(const Address& address, Limits limits, std::string name)
    : state_(std::make_unique<State>(address, limits, std::move(name))) {}

Server::~Server() {
  state_->io.stop();
  if (state_->thread.joinable()) state_->thread.join();
}

void Server::start(Handler& handler) {
  state_->shared.handler = &handler;
  state_->accept();
  state_->thread = std::thread([state = state_.get()] { state->io.run(); });
}

const Address& Server::address() const noexcept { return state_->address; }
void Server::post(std::function<void()> task) { asio::post(state_->io, std::move(task)); }
}  // namespace lbea::http
