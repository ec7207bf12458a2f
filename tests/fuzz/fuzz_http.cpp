// Arbitrary bytes as input from a browser or a viewer of the monitor. The first byte selects the kind: the header of an
// HTTP request, messages on a viewer's WebSocket, or an address on the command line. Only requests with a known host
// name, our own origin and our token may get anything.
#include "tools/monitor/web/web_server.hpp"

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
  std::string rows_after(LogCursors&) override { return {}; }
  std::optional<http::Response> respond(std::string_view target) override {
    if (http::query_value(target, "shape").empty()) return {};
    return http::Response{200, "text/plain", "feed"};
  }
};

bool is_ours(std::string host) {
  for (char& c : host) c = c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c;
  for (const char* name : {"127.0.0.1:8080", "localhost:8080", "[::1]:8080", "rig.lab:8080"})
    if (host == name) return true;
  return false;
}

void check_request(const http::Request& request, bool knows_token) {
  static EmptyFeed feed;
  static const WebConfig config{{"127.0.0.1", 8080, true}, {"rig.lab"}, token, {}, true, {"https://viewer.example"}};
  static WebSite site(config, feed);
  const bool is_known = is_ours(std::string(request.host)) && knows_token;
  const unsigned status = site.respond(request).status;
  if (status == 200 || status == 404) require(is_known && (request.method == "GET" || request.method == "HEAD"));
  const bool is_watcher = !site.refuse_watcher(request), is_viewer = !site.refuse_viewer(request);
  require(!(is_watcher || is_viewer) || (is_known && request.method == "GET") ||
          (is_watcher && request.method == "HEAD"));
  static_cast<void>(viewer_subprotocol(request.subprotocols));
}

void fuzz_request(std::string_view text) {
  http::read_request(text, 16 * 1024, [&](const http::Request& request) {
    check_request(request, text.find(token) != std::string_view::npos);
  });
}

/// Several messages, one per line.
void fuzz_messages(std::string_view text) {
  ViewerSubscriptions subscriptions;
  while (!text.empty()) {
    const std::string_view message = text.substr(0, text.find('\n'));
    text.remove_prefix(std::min(message.size() + 1, text.size()));
    const std::string problem = subscriptions.apply(message);
    require(!viewer_notice(ViewerNotice::warning, problem).empty());
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size == 0) return 0;
  const std::string_view text(reinterpret_cast<const char*>(data + 1), size - 1);
  if (data[0] == 'm') {
    fuzz_messages(text);
  } else if (data[0] == 'a') {
    try {
      const http::Address address = http::parse_address(std::string(text), "--http");
      require(http::is_numeric_address(address.host));
    } catch (const Error& error) { require(error.what()[0] != '\0'); }
  } else {
    fuzz_request(text);
  }
  return 0;
}
