#include "tools/monitor/web/web_session.hpp"

#include "tools/monitor/web/viewer_session.hpp"

#include <lbea/version.hpp>

#include <utility>

namespace lbea::tool::web {
namespace {

using namespace std::chrono_literals;

constexpr std::uint32_t largest_head = 16 * 1024;
constexpr std::size_t largest_client_message = 1024;
constexpr std::size_t many_rows_bytes = 64 * 1024;  // after so many at once more may wait
constexpr auto upgrade_timeout = 5s;
constexpr int send_buffer_bytes = 256 * 1024;  // a snapshot or two: more would only be old when it arrives
// Nothing but this program's own files, no inline script or style, nowhere to send anything, in nobody's frame.
constexpr auto content_policy =
    "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' data: blob:; connect-src 'self'; font-src "
    "'self'; "
    "base-uri 'none'; form-action 'none'; frame-ancestors 'none'";

std::string_view text_of(beast::string_view text) { return {text.data(), text.size()}; }

void protect(Response& response) {
  response.set("Content-Security-Policy", content_policy);
  response.set("X-Content-Type-Options", "nosniff");
  response.set("X-Frame-Options", "DENY");
  response.set("Referrer-Policy", "no-referrer");
  response.set("Cross-Origin-Opener-Policy", "same-origin");
  response.set("Cross-Origin-Resource-Policy", "same-origin");
  response.set(http::field::cache_control, "no-store");
  response.set(http::field::server, "lbea-monitor");
}

Response make_response(const Request& request, unsigned status, std::string_view type, std::string body) {
  Response response{static_cast<http::status>(status), request.version()};
  protect(response);
  response.set(http::field::content_type, beast::string_view(type.data(), type.size()));
  response.keep_alive(request.keep_alive());
  response.body() = std::move(body);
  response.prepare_payload();
  if (request.method() == http::verb::head) response.body().clear();
  return response;
}

Response refusal(const Request& request, unsigned status, std::string_view sentence) {
  Response response = make_response(request, status, "text/plain; charset=utf-8", std::string(sentence) + "\n");
  response.keep_alive(false);
  return response;
}

Response refusal(const Request& request, Access access) {
  const unsigned status = access == Access::wrong_method ? 405 : access == Access::wrong_token ? 401 : 403;
  Response response = refusal(request, status, explain(access));
  if (status == 405) response.set(http::field::allow, "GET, HEAD");
  return response;
}

std::optional<Response> refuse_crowd(Shared& shared, const Request& request) {
  if (shared.watching + shared.viewing >= shared.limits.watchers)
    return refusal(request, 503, "Too many browsers watch already; close one.");
  return {};
}

/// Moves the token from the address, which is shown and stored in many places, to a cookie.
Response to_cookie(const Request& request, const AccessRules& rules) {
  Response response = make_response(request, 303, "text/plain; charset=utf-8", "");
  response.set(http::field::location, "/");
  response.set(http::field::set_cookie,
               rules.cookie_name() + "=" + rules.token() + "; Path=/; HttpOnly; SameSite=Strict");
  return response;
}

}  // namespace

RequestHead head_of(const Request& request) {
  const auto field = [&](http::field name) { return text_of(request[name]); };
  return {text_of(request.method_string()), text_of(request.target()),  field(http::field::host),
          field(http::field::origin),       field(http::field::cookie), field(http::field::authorization)};
}

Response respond(Shared& shared, const Request& request) {
  const Access access = shared.rules.check(head_of(request));
  if (access == Access::token_in_address) return to_cookie(request, shared.rules);
  if (access != Access::granted) return refusal(request, access);
  const std::string_view target = text_of(request.target());
  if (auto asset = shared.assets.find(target.substr(0, target.find('?'))))
    return make_response(request, 200, asset->content_type, std::move(asset->bytes));
  try {
    auto answer = shared.feed.answer(target);
    if (!answer) return refusal(request, 404, "There is nothing of that name here.");
    Response response = make_response(request, answer->status, answer->content_type, std::move(answer->body));
    if (!answer->file_name.empty())
      response.set(http::field::content_disposition, "attachment; filename=\"" + answer->file_name + "\"");
    return response;
  } catch (const std::exception& error) { return refusal(request, 500, error.what()); }
}

std::optional<Response> refuse_watcher(Shared& shared, const Request& request) {
  const RequestHead head = head_of(request);
  if (const Access access = shared.rules.check(head); access != Access::granted)
    return refusal(request, access == Access::token_in_address ? Access::wrong_token : access);
  if (head.target != "/live") return refusal(request, 404, "There is nothing to watch under that name.");
  return refuse_crowd(shared, request);
}

std::optional<Response> refuse_viewer(Shared& shared, const Request& request) {
  if (!shared.has_viewers)
    return refusal(request, 404, "Start lbea-monitor with --foxglove for viewers that speak Foxglove's protocol.");
  if (const Access access = shared.rules.check_viewer(head_of(request)); access != Access::granted)
    return refusal(request, access);
  return refuse_crowd(shared, request);
}

Conversation::Conversation(tcp::socket socket, Shared& shared)
    : stream_(std::move(socket)), shared_(shared), seat_(shared.connections) {}

void Conversation::read() {
  parser_.emplace();
  parser_->header_limit(largest_head);
  parser_->body_limit(0);
  stream_.expires_after(shared_.limits.request_timeout);
  http::async_read(stream_, buffer_, *parser_, [self = shared_from_this()](beast::error_code error, std::size_t) {
    if (!error) self->answer();
  });
}

void Conversation::answer() {
  const Request& request = parser_->get();
  if (!websocket::is_upgrade(request)) return send(respond(shared_, request));
  upgrade(request);
}

void Conversation::upgrade(const Request& request) {
  const std::string_view subprotocol = viewer_subprotocol(text_of(request[http::field::sec_websocket_protocol]));
  if (auto refused = subprotocol.empty() ? refuse_watcher(shared_, request) : refuse_viewer(shared_, request))
    return send(std::move(*refused));
  stream_.expires_never();
  if (subprotocol.empty())
    std::make_shared<Watcher>(std::move(stream_), shared_, std::move(seat_))->accept(request);
  else
    std::make_shared<Viewer>(std::move(stream_), shared_, std::move(seat_))->accept(request, subprotocol);
}

void Conversation::send(Response response) {
  response_ = std::move(response);
  stream_.expires_after(shared_.limits.request_timeout);
  http::async_write(stream_, *response_, [self = shared_from_this()](beast::error_code error, std::size_t) {
    if (!error && self->response_->keep_alive()) self->read();
  });
}

Watcher::Watcher(beast::tcp_stream stream, Shared& shared, Seat seat)
    : stream_(std::move(stream)),
      shared_(shared),
      connection_(std::move(seat)),
      watching_(shared.watching),
      buffer_(largest_client_message) {
  shared_.watchers.insert(this);
  boost::system::error_code ignored;
  beast::get_lowest_layer(stream_).socket().set_option(boost::asio::socket_base::send_buffer_size(send_buffer_bytes),
                                                       ignored);
}

Watcher::~Watcher() { shared_.watchers.erase(this); }

void Watcher::accept(const Request& request) {
  stream_.set_option(websocket::stream_base::timeout{upgrade_timeout, shared_.limits.silence, true});
  stream_.set_option(websocket::stream_base::decorator(
      [](websocket::response_type& response) { response.set(http::field::server, "lbea-monitor"); }));
  stream_.auto_fragment(false);  // else a system call for every 4 kB
  stream_.read_message_max(largest_client_message);
  stream_.binary(true);
  stream_.async_accept(request, [self = shared_from_this()](beast::error_code error) {
    if (error) return;
    self->open_ = true;
    self->read();
    self->write_next();
  });
}

void Watcher::read() {
  stream_.async_read(buffer_, [self = shared_from_this()](beast::error_code error, std::size_t) {
    // A browser has nothing to say here: whoever talks is not our page.
    self->open_ = false;
    self->ready_.reset();
    if (!error) beast::get_lowest_layer(self->stream_).close();
  });
}

void Watcher::wake() {
  rows_due_ = true;
  if (ready_) write_next();
}

void Watcher::write_next() {
  const bool has_snapshot = shared_.latest != nullptr && shared_.latest != sent_;
  // In turns: a slow browser would else get nothing but snapshots.
  if (has_snapshot && !std::exchange(rows_turn_, rows_due_ && !rows_turn_)) return write(sent_ = shared_.latest);
  rows_turn_ = false;
  if (rows_due_) {
    auto rows = shared_.feed.rows_after(cursor_);
    rows_due_ = rows.size() > many_rows_bytes;
    if (!rows.empty()) return write(std::make_shared<const std::string>(std::move(rows)));
  }
  if (has_snapshot) return write(sent_ = shared_.latest);
  ready_.emplace(shared_.ready);
}

void Watcher::write(Snapshot message) {
  ready_.reset();
  in_flight_ = std::move(message);
  stream_.async_write(boost::asio::buffer(*in_flight_),
                      [self = shared_from_this()](beast::error_code error, std::size_t) {
                        self->in_flight_.reset();
                        if (!error && self->open_) self->write_next();
                      });
}

}  // namespace lbea::tool::web
