#include "adapters/http/metrics_server.hpp"

#include <lbea/lbea.hpp>

#include <chrono>
#include <thread>

#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/beast/core.hpp>
#include <boost/beast/http.hpp>

namespace lbea::http {
namespace {

namespace beast = boost::beast;
namespace http = beast::http;
using tcp = boost::asio::ip::tcp;

[[noreturn]] void refuse(const std::string& address, const std::string& why) {
  throw Error{Status::bad_config, "metrics address \"" + address + "\": " + why};
}

tcp::endpoint parse(const std::string& address) {
  const auto colon = address.rfind(':');
  if (colon == std::string::npos) refuse(address, "no port; write 127.0.0.1:9464");
  const std::string host = address.substr(0, colon), port = address.substr(colon + 1);
  boost::system::error_code error;
  const auto ip = boost::asio::ip::make_address_v4(host == "localhost" ? "127.0.0.1" : host, error);
  if (error || !ip.is_loopback())
    refuse(address, "everyone who reaches it may read it, so only this machine may; write 127.0.0.1:9464");
  const bool is_number = !port.empty() && port.size() < 6 && port.find_first_not_of("0123456789") == std::string::npos;
  if (!is_number || std::stoul(port) > 65'535) refuse(address, "\"" + port + "\" is not a port");
  return {ip, static_cast<std::uint16_t>(std::stoul(port))};
}

/// A page from elsewhere, opened in a browser of this machine, asks under its own name (DNS rebinding).
bool is_local_name(std::string host) {
  host = host.substr(0, host.rfind(':'));
  return host.empty() || host == "localhost" || host.starts_with("127.");
}

}  // namespace

struct MetricsServer::State {
  State(const tcp::endpoint& where, std::function<std::string()> page_, Limits limits_)
      : acceptor(io, where), page(std::move(page_)), limits(limits_) {}
  void accept();

  boost::asio::io_context io{1};
  tcp::acceptor acceptor;
  std::function<std::string()> page;
  Limits limits;
  std::size_t open = 0;
  std::thread thread;
};

namespace {

/// One connection: one request, one answer.
template <class Server>
class Visit : public std::enable_shared_from_this<Visit<Server>> {
 public:
  Visit(Server& server, tcp::socket socket) : server_(server), stream_(std::move(socket)) {
    ++server_.open;
    parser_.header_limit(static_cast<std::uint32_t>(server_.limits.request_bytes));
    parser_.body_limit(0);
  }
  ~Visit() { --server_.open; }

  void begin() {
    stream_.expires_after(std::chrono::milliseconds(server_.limits.deadline_ms));
    http::async_read(stream_, buffer_, parser_,
                     [self = this->shared_from_this()](beast::error_code error, std::size_t) {
                       if (!error) self->answer();
                     });
  }

 private:
  void answer() {
    const auto& request = parser_.get();
    const bool is_read = request.method() == http::verb::get || request.method() == http::verb::head;
    const auto path = request.target().substr(0, request.target().find('?'));
    const bool is_page = path == "/metrics" || path == "/";
    http::status status = http::status::ok;
    if (!is_local_name(std::string(request[http::field::host]))) {
      status = http::status::forbidden;
    } else if (!is_read) {
      status = http::status::method_not_allowed;
    } else if (!is_page) {
      status = http::status::not_found;
    }
    response_.result(status);
    response_.set(http::field::content_type, "text/plain; version=0.0.4; charset=utf-8");
    response_.set("X-Content-Type-Options", "nosniff");
    response_.keep_alive(false);
    if (status == http::status::ok) response_.body() = server_.page();
    response_.prepare_payload();
    if (request.method() == http::verb::head) response_.body().clear();
    http::async_write(stream_, response_, [self = this->shared_from_this()](beast::error_code, std::size_t) {
      beast::error_code ignored;
      self->stream_.socket().shutdown(tcp::socket::shutdown_both, ignored);
    });
  }

  Server& server_;
  beast::tcp_stream stream_;
  beast::flat_buffer buffer_;
  http::request_parser<http::empty_body> parser_;
  http::response<http::string_body> response_;
};

}  // namespace

void MetricsServer::State::accept() {
  acceptor.async_accept([this](boost::system::error_code error, tcp::socket socket) {
    if (error == boost::asio::error::operation_aborted) return;
    if (!error && open < limits.connections) std::make_shared<Visit<State>>(*this, std::move(socket))->begin();
    if (error) std::this_thread::sleep_for(std::chrono::milliseconds(50));  // out of descriptors: not in a tight loop
    accept();
  });
}

MetricsServer::MetricsServer(const std::string& address, std::function<std::string()> page, Limits limits) {
  const tcp::endpoint where = parse(address);
  try {
    state_ = std::make_unique<State>(where, std::move(page), limits);
  } catch (const boost::system::system_error& error) {
    throw Error{Status::endpoint_unavailable, "metrics address \"" + address + "\" cannot be opened (" +
                                                  error.code().message() + "); choose another port"};
  }
  state_->accept();
  state_->thread = std::thread([state = state_.get()] { state->io.run(); });
}

MetricsServer::~MetricsServer() {
  state_->io.stop();
  state_->thread.join();
}

std::string MetricsServer::address() const {
  const tcp::endpoint where = state_->acceptor.local_endpoint();
  return where.address().to_string() + ":" + std::to_string(where.port());
}

}  // namespace lbea::http
