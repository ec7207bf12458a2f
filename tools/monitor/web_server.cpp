#include "tools/monitor/web_server.hpp"

#include "tools/monitor/web_session.hpp"

#include <lbea/lbea.hpp>

#include <boost/asio/post.hpp>
#include <boost/asio/steady_timer.hpp>

#include <mutex>
#include <thread>

namespace lbea {

namespace asio = boost::asio;
using tcp = asio::ip::tcp;

struct WebServer::State {
  State(const HttpAddress& bound, const WebConfig& config, Assets assets, Feed& feed)
      : address(bound), shared{AccessRules(bound, config.allowed_names, config.token), std::move(assets), feed, config.limits, {}, {}, {}, {}} {}
  void accept();
  void take_newest();

  HttpAddress address;  // with the port as bound
  web::Shared shared;
  asio::io_context io{1};
  tcp::acceptor acceptor{io};
  asio::steady_timer pause{io};
  std::mutex mutex;
  Snapshot newest;  // the mutex's; null once taken
  std::thread thread;
};

namespace {

tcp::acceptor bind(asio::io_context& io, const HttpAddress& address) {
  const tcp::endpoint endpoint(asio::ip::make_address(address.host), address.port);
  try {
    tcp::acceptor acceptor(io, endpoint.protocol());
    acceptor.set_option(tcp::acceptor::reuse_address(true));
    acceptor.bind(endpoint);
    acceptor.listen();
    return acceptor;
  } catch (const boost::system::system_error& error) {
    throw Error(Status::endpoint_unavailable, "cannot serve on " + address.host + " port " + std::to_string(address.port) + " (" +
                                                  error.code().message() + "); stop what uses it or choose another with --http");
  }
}

}  // namespace

void WebServer::State::accept() {
  acceptor.async_accept([this](boost::system::error_code error, tcp::socket socket) {
    if (error == asio::error::operation_aborted) return;
    if (!error && shared.connections < shared.limits.connections) std::make_shared<web::Conversation>(std::move(socket), shared)->read();
    if (!error) return accept();
    // Out of descriptors, for example: look again a little later.
    pause.expires_after(std::chrono::milliseconds(100));
    pause.async_wait([this](boost::system::error_code stopped) {
      if (!stopped) accept();
    });
  });
}

void WebServer::State::take_newest() {
  {
    const std::lock_guard lock(mutex);
    shared.latest = std::exchange(newest, nullptr);
  }
  const auto watchers = shared.watchers;
  for (web::Watcher* watcher : watchers) watcher->wake();
}

WebServer::WebServer(const WebConfig& config, Assets assets, Feed& feed) {
  HttpAddress bound = config.address;
  auto state = std::make_unique<State>(bound, config, std::move(assets), feed);
  state->acceptor = bind(state->io, config.address);
  bound.port = state->acceptor.local_endpoint().port();
  state->address = bound;
  state->shared.rules = AccessRules(bound, config.allowed_names, config.token);
  state->accept();
  state_ = std::move(state);
  state_->thread = std::thread([io = &state_->io] { io->run(); });
}

WebServer::~WebServer() {
  state_->io.stop();
  state_->thread.join();
}

std::string WebServer::url() const {
  const HttpAddress& address = state_->address;
  std::string host = address.host == "0.0.0.0" ? "127.0.0.1" : address.host == "::" ? "::1" : address.host;
  if (host.find(':') != std::string::npos) host = "[" + host + "]";
  const std::string& token = state_->shared.rules.token();
  return "http://" + host + ":" + std::to_string(address.port) + "/" + (token.empty() ? "" : "?token=" + token);
}

std::uint16_t WebServer::port() const noexcept { return state_->address.port; }

void WebServer::publish(Snapshot snapshot) {
  bool is_first = false;
  {
    const std::lock_guard lock(state_->mutex);
    is_first = state_->newest == nullptr;
    state_->newest = std::move(snapshot);
  }
  // One call waits for the thread at most, however slow it is.
  if (is_first) asio::post(state_->io, [state = state_.get()] { state->take_newest(); });
}

std::size_t WebServer::watchers() const noexcept { return state_->shared.watching; }

}  // namespace lbea
