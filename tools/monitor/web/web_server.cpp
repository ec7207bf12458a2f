#include "tools/monitor/web/web_server.hpp"

#include "tools/monitor/web/viewer_session.hpp"

#include <lbea/lbea.hpp>

#include <boost/asio/post.hpp>
#include <boost/asio/steady_timer.hpp>

#include <mutex>
#include <thread>

namespace lbea::tool {

namespace asio = boost::asio;
using tcp = asio::ip::tcp;

struct WebServer::State {
  State(const HttpAddress& bound, const WebConfig& config, Assets assets, Feed& feed)
      : address(bound),
        shared{AccessRules(bound, config.allowed_names, config.token, config.viewer_origins),
               std::move(assets),
               feed,
               config.limits,
               config.has_viewers,
               random_token(),
               {},
               {},
               {},
               {},
               {},
               {},
               {}} {}
  void accept();
  void take_newest();
  void take_relayed();

  HttpAddress address;  // with the port as bound
  web::Shared shared;
  asio::io_context io{1};
  tcp::acceptor acceptor{io};
  asio::steady_timer pause{io};
  std::mutex mutex;
  // The mutex's:
  Snapshot newest;  // null once taken
  std::vector<std::shared_ptr<const ViewerMessage>> relayed;
  std::thread thread;
};

namespace {

constexpr std::size_t most_relayed = 1024;  // wait for the server's thread

tcp::acceptor bind(asio::io_context& io, const HttpAddress& address) {
  const tcp::endpoint endpoint(asio::ip::make_address(address.host), address.port);
  try {
    tcp::acceptor acceptor(io, endpoint.protocol());
    acceptor.set_option(tcp::acceptor::reuse_address(true));
    acceptor.bind(endpoint);
    acceptor.listen();
    return acceptor;
  } catch (const boost::system::system_error& error) {
    throw Error(Status::endpoint_unavailable, "cannot serve on " + address.host + " port " +
                                                  std::to_string(address.port) + " (" + error.code().message() +
                                                  "); stop what uses it or choose another with --http");
  }
}

}  // namespace

void WebServer::State::accept() {
  acceptor.async_accept([this](boost::system::error_code error, tcp::socket socket) {
    if (error == asio::error::operation_aborted) return;
    if (!error && shared.connections < shared.limits.connections)
      std::make_shared<web::Conversation>(std::move(socket), shared)->read();
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

void WebServer::State::take_relayed() {
  std::vector<std::shared_ptr<const ViewerMessage>> messages;
  {
    const std::lock_guard lock(mutex);
    messages.swap(relayed);
  }
  for (web::Viewer* viewer : shared.viewers)
    for (const auto& message : messages) viewer->offer(message);
}

WebServer::WebServer(const WebConfig& config, Assets assets, Feed& feed) {
  HttpAddress bound = config.address;
  auto state = std::make_unique<State>(bound, config, std::move(assets), feed);
  state->acceptor = bind(state->io, config.address);
  bound.port = state->acceptor.local_endpoint().port();
  state->address = bound;
  state->shared.rules = AccessRules(bound, config.allowed_names, config.token, config.viewer_origins);
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

void WebServer::relay(ViewerMessage message) {
  auto shared = std::make_shared<const ViewerMessage>(std::move(message));
  bool is_first = false;
  {
    const std::lock_guard lock(state_->mutex);
    if (state_->relayed.size() >= most_relayed) return;
    is_first = state_->relayed.empty();
    state_->relayed.push_back(std::move(shared));
  }
  if (is_first) asio::post(state_->io, [state = state_.get()] { state->take_relayed(); });
}

std::size_t WebServer::viewers() const noexcept { return state_->shared.viewing; }

bool WebServer::is_awaited() const noexcept { return state_->shared.ready > 0; }

std::size_t WebServer::watchers() const noexcept { return state_->shared.watching; }

}  // namespace lbea::tool
