#include "tools/monitor/web/web_server.hpp"

#include "adapters/files/atomic_file.hpp"

#include <lbea/lbea.hpp>

#include <algorithm>

namespace lbea::tool {
namespace {

constexpr std::size_t largest_request = 16 * 1024;
constexpr std::size_t many_rows_bytes = 64 * 1024;  // more rows may wait behind a packet of this size
constexpr std::size_t most_relayed = 1024;          // messages that wait for the server's thread
constexpr int send_buffer_bytes = 256 * 1024;       // one or two snapshots: more would be outdated on arrival

/// Only files of this program, no inline scripts or styles, no requests to other sites, no framing.
constexpr auto content_policy =
    "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' data: blob:; connect-src 'self'; font-src "
    "'self'; base-uri 'none'; form-action 'none'; frame-ancestors 'none'";
constexpr std::array<std::pair<const char*, const char*>, 8> protection{{
    {"Content-Security-Policy", content_policy},
    {"X-Content-Type-Options", "nosniff"},
    {"X-Frame-Options", "DENY"},
    {"Referrer-Policy", "no-referrer"},
    {"Cross-Origin-Opener-Policy", "same-origin"},
    {"Cross-Origin-Resource-Policy", "same-origin"},
    {"Cache-Control", "no-store"},
    {"Server", "lbea-monitor"},
}};

http::Response refusal(unsigned status, std::string_view sentence) {
  http::Response response = text_response(status, std::string(sentence));
  response.closes_connection = true;
  return response;
}

http::Response refusal(Access access) {
  const unsigned status = access == Access::wrong_method ? 405 : access == Access::wrong_token ? 401 : 403;
  http::Response response = refusal(status, explain(access));
  if (status == 405) response.headers.emplace_back("Allow", "GET, HEAD");
  return response;
}

http::Response protect(http::Response response) {
  response.headers.insert(response.headers.end(), protection.begin(), protection.end());
  return response;
}

/// Moves the token to a cookie: addresses are displayed and stored in many places.
http::Response to_cookie(const AccessRules& rules) {
  return {303,
          "text/plain; charset=utf-8",
          "",
          {{"Location", "/"},
           {"Set-Cookie", rules.cookie_name() + "=" + rules.token() + "; Path=/; HttpOnly; SameSite=Strict"}}};
}

constexpr std::array<std::pair<std::string_view, std::string_view>, 4> content_types{{
    {".html", "text/html; charset=utf-8"},
    {".js", "text/javascript; charset=utf-8"},
    {".css", "text/css; charset=utf-8"},
    {".svg", "image/svg+xml"},
}};

bool is_plain(std::string_view name) {
  constexpr std::string_view allowed = "abcdefghijklmnopqrstuvwxyz0123456789_-.";
  return !name.empty() && name.front() != '.' && name.find_first_not_of(allowed) == std::string_view::npos;
}

std::optional<std::string> bytes_of(std::string_view name, const std::filesystem::path& folder) {
  if (folder.empty()) {
    const auto assets = embedded_assets();
    const auto found = std::ranges::find(assets, name, &EmbeddedAsset::name);
    return found == assets.end() ? std::nullopt : std::optional(std::string(found->bytes));
  }
  try {
    return std::string(io::as_text(io::read_file(folder / name)));
  } catch (const Error&) { return {}; }
}

/// A file of the page; "/" is the page itself. Finds only plain names of known types.
std::optional<http::Response> asset(std::string_view path, const std::filesystem::path& folder) {
  std::string_view name = path.substr(std::min<std::size_t>(1, path.size()));
  if (name.empty()) name = "index.html";
  if (!is_plain(name)) return {};
  const auto type =
      std::ranges::find_if(content_types, [&](const auto& candidate) { return name.ends_with(candidate.first); });
  if (type == content_types.end()) return {};
  auto bytes = bytes_of(name, folder);
  if (!bytes) return {};
  return http::Response{200, std::string(type->second), std::move(*bytes)};
}

}  // namespace

/// A browser that shows a running test. It gets the latest snapshot whenever it has received the previous one, and the
/// new rows of the curves.
class WatcherSession final : public http::WebSocketSession {
 public:
  explicit WatcherSession(WebSite& site) : site_(site) { site_.watchers.add(this); }
  ~WatcherSession() override {
    set_ready(false);
    site_.watchers.remove(this);
  }
  void opened(http::WebSocket& socket) override {
    socket_ = &socket;
    send_next();
  }
  void received(std::string_view) override { socket_->close(); }  // the page never sends: this is another client
  void sent() override {
    in_flight_.reset();
    send_next();
  }
  void wake() {
    rows_due_ = true;
    if (is_ready_) send_next();
  }

 private:
  void send_next() {
    const bool has_snapshot = site_.latest_ != nullptr && site_.latest_ != shown_;
    // Snapshots and rows alternate; otherwise a slow browser would get nothing but snapshots.
    if (has_snapshot && !std::exchange(rows_turn_, rows_due_ && !rows_turn_)) return send(shown_ = site_.latest_);
    rows_turn_ = false;
    if (rows_due_) {
      auto rows = site_.feed_.rows_after(cursors_);
      rows_due_ = rows.size() > many_rows_bytes;
      if (!rows.empty()) return send(std::make_shared<const std::string>(std::move(rows)));
    }
    if (has_snapshot) return send(shown_ = site_.latest_);
    set_ready(true);
  }
  void send(Snapshot message) {
    set_ready(false);
    in_flight_ = std::move(message);
    socket_->send(http::MessageType::binary, *in_flight_);
  }
  void set_ready(bool is_ready) {
    if (is_ready != std::exchange(is_ready_, is_ready)) is_ready ? ++site_.ready : --site_.ready;
  }

  WebSite& site_;
  http::WebSocket* socket_ = nullptr;
  Snapshot shown_, in_flight_;
  LogCursors cursors_;
  bool is_ready_ = false, rows_turn_ = false;
  bool rows_due_ = true;  // rows are sent along with snapshots: a message for each would overload the page
};

WebSite::WebSite(const WebConfig& config, Feed& feed)
    : rules_(config.address, config.allowed_names, config.token, config.viewer_origins, config.public_origin),
      config_(config),
      feed_(feed) {}

http::Response WebSite::respond(const http::Request& request) {
  const Access access = rules_.check(request);
  if (access == Access::token_in_address) return protect(to_cookie(rules_));
  if (access != Access::granted) return protect(refusal(access));
  try {
    auto response = asset(request.path(), config_.assets_folder);
    if (!response) response = feed_.respond(request.target);
    return protect(response ? std::move(*response) : refusal(404, "No such page."));
  } catch (const std::exception& error) { return protect(refusal(500, error.what())); }
}

http::Upgrade WebSite::upgrade(const http::Request& request) {
  const std::string_view subprotocol = viewer_subprotocol(request.subprotocols);
  const bool is_viewer = !subprotocol.empty();
  if (auto refused = is_viewer ? refuse_viewer(request) : refuse_watcher(request))
    return {nullptr, protect(std::move(*refused))};
  if (is_viewer)
    return {std::make_unique<Viewer>(viewers, session_), {}, std::string(subprotocol), Viewer::largest_message};
  return {.session = std::make_unique<WatcherSession>(*this), .send_buffer_bytes = send_buffer_bytes};
}

std::optional<http::Response> WebSite::refuse_when_full() const {
  if (watchers.count + viewers.count < config_.limits.watchers) return {};
  return refusal(503, "Too many browsers are connected; close one.");
}

std::optional<http::Response> WebSite::refuse_watcher(const http::Request& request) const {
  if (const Access access = rules_.check(request); access != Access::granted)
    return refusal(access == Access::token_in_address ? Access::wrong_token : access);
  if (request.target != "/live") return refusal(404, "No such WebSocket.");
  return refuse_when_full();
}

std::optional<http::Response> WebSite::refuse_viewer(const http::Request& request) const {
  if (!config_.has_viewers)
    return refusal(404, "Start lbea-monitor with --foxglove to connect viewers that use the Foxglove protocol.");
  if (const Access access = rules_.check_viewer(request); access != Access::granted) return refusal(access);
  return refuse_when_full();
}

void WebSite::show(Snapshot latest) {
  latest_ = std::move(latest);
  for (WatcherSession* watcher : watchers.all) watcher->wake();
}

WebServer::WebServer(const WebConfig& config, Feed& feed)
    : site_(config, feed),
      server_(config.address,
              {.connections = config.limits.connections,
               .request_bytes = largest_request,
               .request_timeout = config.limits.request_timeout,
               .response_timeout = config.limits.request_timeout,
               .silence = config.limits.silence},
              "lbea-monitor") {
  site_.set_port(port());
  server_.start(site_);
}

std::string WebServer::url() const {
  http::Address address = server_.address();
  if (address.host == "0.0.0.0") address.host = "127.0.0.1";
  if (address.host == "::") address.host = "::1";
  const std::string &token = site_.rules().token(), &proxy = site_.rules().public_origin();
  return (proxy.empty() ? "http://" + to_string(address) : proxy) + "/" + (token.empty() ? "" : "?token=" + token);
}

void WebServer::publish(Snapshot snapshot) {
  const std::lock_guard lock(mutex_);
  // At most one task waits for the server's thread.
  if (std::exchange(newest_, std::move(snapshot)) == nullptr) server_.post([this] { show_newest(); });
}

void WebServer::show_newest() {
  std::unique_lock lock(mutex_);
  Snapshot newest = std::exchange(newest_, nullptr);
  lock.unlock();
  site_.show(std::move(newest));
}

void WebServer::relay(ViewerMessage message) {
  auto shared = std::make_shared<const ViewerMessage>(std::move(message));
  const std::lock_guard lock(mutex_);
  if (relayed_.size() >= most_relayed) return;
  relayed_.push_back(std::move(shared));
  if (relayed_.size() == 1) server_.post([this] { offer_relayed(); });
}

void WebServer::offer_relayed() {
  std::unique_lock lock(mutex_);
  const auto messages = std::exchange(relayed_, {});
  lock.unlock();
  for (Viewer* viewer : site_.viewers.all)
    for (const auto& message : messages) viewer->offer(message);
}

}  // namespace lbea::tool
