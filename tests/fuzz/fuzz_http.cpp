// Any bytes as what a browser or a viewer says to the monitor. The first byte chooses: an HTTP request's head, a
// message over a viewer's WebSocket, or an address on the command line. Whoever does not ask under our name and from
// our own page with our token gets nothing.
#include "tools/monitor/web/web_session.hpp"

#include <lbea/lbea.hpp>

#include <cstdlib>

namespace {

using namespace lbea;
using namespace lbea::tool;
using namespace lbea::wire;

constexpr const char* token = "0123456789abcdef";

void require(bool holds) {
  if (!holds) std::abort();
}

class EmptyFeed final : public Feed {
 public:
  std::string rows_after(LogCursor&) override { return {}; }
  std::optional<HttpAnswer> answer(std::string_view target) override {
    if (query_value(target, "shape").empty()) return {};
    return HttpAnswer{200, "text/plain", "feed", ""};
  }
};

bool is_ours(std::string host) {
  for (char& c : host) c = c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c;
  for (const char* name : {"127.0.0.1:8080", "localhost:8080", "[::1]:8080", "rig.lab:8080"})
    if (host == name) return true;
  return false;
}

void take_request(std::string_view text) {
  static EmptyFeed feed;
  static web::Shared shared{AccessRules({"127.0.0.1", 8080, true}, {"rig.lab"}, token, {"https://viewer.example"}),
                            Assets(),
                            feed,
                            {},
                            true,
                            "1",
                            0,
                            0,
                            0,
                            0,
                            {},
                            {},
                            nullptr};
  web::http::request_parser<web::http::empty_body> parser;
  parser.header_limit(16 * 1024);
  parser.body_limit(0);
  parser.eager(true);
  web::beast::error_code error;
  parser.put(boost::asio::buffer(text.data(), text.size()), error);
  if (error || !parser.is_done()) return;
  const web::Request& request = parser.get();
  const RequestHead head = web::head_of(request);
  const std::string host(head.host);
  const unsigned status = web::respond(shared, request).result_int();
  const bool knows_token = text.find(token) != std::string_view::npos;
  if (status == 200 || status == 404)
    require(is_ours(host) && knows_token && (head.method == "GET" || head.method == "HEAD"));
  const bool is_watcher = !web::refuse_watcher(shared, request), is_viewer = !web::refuse_viewer(shared, request);
  require(!(is_watcher || is_viewer) || (is_ours(host) && knows_token && head.method == "GET") ||
          (is_watcher && head.method == "HEAD"));
  static_cast<void>(viewer_subprotocol(std::string_view(request[web::http::field::sec_websocket_protocol].data(),
                                                        request[web::http::field::sec_websocket_protocol].size())));
}

/// Several messages, each on a line.
void take_messages(std::string_view text) {
  ViewerSubscriptions subscriptions;
  while (!text.empty()) {
    const std::string_view message = text.substr(0, text.find('\n'));
    text.remove_prefix(std::min(message.size() + 1, text.size()));
    const std::string complaint = subscriptions.take(message);
    require(!viewer_notice(ViewerNotice::warning, complaint).empty());
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size == 0) return 0;
  const std::string_view text(reinterpret_cast<const char*>(data + 1), size - 1);
  if (data[0] == 'm') {
    take_messages(text);
  } else if (data[0] == 'a') {
    try {
      const HttpAddress address = parse_http_address(std::string(text));
      require(is_numeric_address(address.host));
    } catch (const Error& error) { require(error.what()[0] != '\0'); }
  } else {
    take_request(text);
  }
  return 0;
}
