// The web server over real sockets: access, limits, and the cost of stalled and hostile clients.
#include "tests/monitor/raw_client.hpp"
#include "tests/wire/wire_support.hpp"
#include "tools/monitor/web/web_server.hpp"

#include <doctest/doctest.h>

#include <atomic>
#include <fstream>
#include <memory>
#include <thread>
#include <vector>

using namespace lbea;
using namespace lbea::tool;
using namespace lbea::wire;
using namespace lbea::test;
using namespace std::chrono_literals;

namespace {

class FakeFeed final : public Feed {
 public:
  std::string rows_after(LogCursors& cursors) override {
    if (!cursors.empty()) return "";
    cursors.resize(1);
    return "rows";
  }
  std::optional<http::Response> respond(std::string_view target) override {
    if (target.starts_with("/api/echo")) return http::Response{200, "text/plain", std::string(target)};
    return {};
  }
};

struct Bench {
  FakeFeed feed;
  WebServer server;
  explicit Bench(WebLimits limits = {}, std::string token = "", std::string host = "127.0.0.1")
      : server({{host, 0, host.starts_with("127.")}, {"rig.lab"}, std::move(token), limits}, feed) {}
  RawClient client() const { return RawClient(server.port()); }
};

std::string status_of(const std::string& answer) {
  return answer.substr(0, std::min(answer.find("\r\n"), answer.size()));
}

std::size_t resident_kb() {
  std::ifstream status("/proc/self/status");
  for (std::string line; std::getline(status, line);)
    if (line.starts_with("VmRSS:")) return std::stoull(line.substr(6));
  return 0;
}

}  // namespace

TEST_CASE("the page is served with protective headers") {
  Bench bench;
  const std::string answer = bench.client().ask("GET /");
  CHECK(status_of(answer) == "HTTP/1.1 200 OK");
  CHECK(contains(answer, "Content-Security-Policy: default-src 'none'; script-src 'self'; style-src 'self'"));
  CHECK(!contains(answer, "unsafe"));
  CHECK(contains(answer, "X-Content-Type-Options: nosniff"));
  CHECK(contains(answer, "frame-ancestors 'none'"));
  CHECK(contains(answer, "Cross-Origin-Resource-Policy: same-origin"));
  CHECK(contains(answer, "Content-Type: text/html"));
  CHECK(contains(bench.client().ask("GET /app.js"), "Content-Type: text/javascript"));
  CHECK(contains(bench.client().ask("GET /app.css"), "Content-Type: text/css"));
  CHECK(contains(bench.client().ask("GET /api/echo?a=1"), "/api/echo?a=1"));
  const std::string head = bench.client().ask("HEAD /");
  CHECK(status_of(head) == "HTTP/1.1 200 OK");
  CHECK(head.ends_with("\r\n\r\n"));
}

TEST_CASE("the page refers to embedded files only and to no other site") {
  Bench bench;
  const std::string page = bench.client().ask("GET /");
  CHECK(contains(page, "src=\"/app.js\""));
  CHECK(contains(page, "href=\"/app.css\""));
  CHECK(!contains(page, "<style"));
  CHECK(!contains(page, "style="));
  CHECK(!contains(page, "onclick"));
  CHECK(!contains(page, "https://"));
}

TEST_CASE("unknown names and paths out of the folder are not found") {
  Bench bench;
  for (const std::string& path :
       std::vector<std::string>{"/nothing.js", "/../etc/passwd", "/..%2f..%2fetc/passwd", "//etc/passwd", "/.hidden.js",
                                "/index.html/", "/INDEX.HTML", "/app.js%00"})
    CHECK_MESSAGE(status_of(bench.client().ask("GET " + path)) == "HTTP/1.1 404 Not Found", path);
}

TEST_CASE("only GET and HEAD are accepted") {
  Bench bench;
  for (const std::string& method : std::vector<std::string>{"POST", "PUT", "DELETE", "OPTIONS", "PATCH"})
    CHECK_MESSAGE(status_of(bench.client().ask(method + " /")) == "HTTP/1.1 405 Method Not Allowed", method);
}

TEST_CASE("a foreign host name or origin is refused, also for the WebSocket") {
  Bench bench;
  const std::string port = std::to_string(bench.server.port());
  for (const std::string& host :
       std::vector<std::string>{"evil.example:" + port, "127.0.0.1.evil.example:" + port, std::string("127.0.0.1:1"),
                                std::string("127.0.0.1"), "10.0.0.7:" + port}) {
    CHECK_MESSAGE(status_of(bench.client().ask("GET /", "", host)) == "HTTP/1.1 403 Forbidden", host);
    CHECK_MESSAGE(status_of(bench.client().upgrade("", host)) == "HTTP/1.1 403 Forbidden", host);
  }
  for (const std::string& host :
       std::vector<std::string>{"localhost:" + port, "LOCALHOST:" + port, "[::1]:" + port, "rig.lab:" + port})
    CHECK_MESSAGE(status_of(bench.client().ask("GET /", "", host)) == "HTTP/1.1 200 OK", host);
  for (const std::string& origin : std::vector<std::string>{"http://evil.example", "null", "https://127.0.0.1:" + port,
                                                            "http://127.0.0.1:1", "http://localhost:" + port})
    CHECK_MESSAGE(status_of(bench.client().upgrade("Origin: " + origin + "\r\n")) == "HTTP/1.1 403 Forbidden", origin);
  CHECK(status_of(bench.client().upgrade("Origin: http://127.0.0.1:" + port + "\r\n")) ==
        "HTTP/1.1 101 Switching Protocols");
}

TEST_CASE("other addresses need a token, which moves from the address to a cookie") {
  CHECK(error_of([] { Bench bench({}, "", "0.0.0.0"); }).status == Status::bad_config);
  Bench bench({}, "0123456789abcdef", "0.0.0.0");
  const std::string cookie = "lbea_monitor_" + std::to_string(bench.server.port()) + "=";
  CHECK(bench.server.url().ends_with("/?token=0123456789abcdef"));
  CHECK(status_of(bench.client().ask("GET /")) == "HTTP/1.1 401 Unauthorized");
  CHECK(status_of(bench.client().ask("GET /?token=0123456789abcdee")) == "HTTP/1.1 401 Unauthorized");
  CHECK(status_of(bench.client().ask("GET /?token=")) == "HTTP/1.1 401 Unauthorized");
  const std::string moved = bench.client().ask("GET /?token=0123456789abcdef");
  CHECK(status_of(moved) == "HTTP/1.1 303 See Other");
  CHECK(contains(moved, "Set-Cookie: " + cookie + "0123456789abcdef; Path=/; HttpOnly; SameSite=Strict"));
  CHECK(status_of(bench.client().ask("GET /", "Cookie: other=1; " + cookie + "0123456789abcdef\r\n")) ==
        "HTTP/1.1 200 OK");
  CHECK(status_of(bench.client().ask("GET /", "Cookie: " + cookie + "0123456789abcdeg\r\n")) ==
        "HTTP/1.1 401 Unauthorized");
  CHECK(status_of(bench.client().ask("GET /", "Authorization: Bearer 0123456789abcdef\r\n")) == "HTTP/1.1 200 OK");
  CHECK(status_of(bench.client().upgrade()) == "HTTP/1.1 401 Unauthorized");
  CHECK(status_of(bench.client().upgrade("Cookie: " + cookie + "0123456789abcdef\r\n")) ==
        "HTTP/1.1 101 Switching Protocols");
  CHECK(status_of(bench.client().ask("GET /", "", "rebound.example:" + std::to_string(bench.server.port()))) ==
        "HTTP/1.1 403 Forbidden");
}

// Regression: behind the TLS proxy that the guide recommends, the page answered 403.
TEST_CASE("behind a proxy the page is served under the proxy's origin, with a token") {
  FakeFeed feed;
  const auto serve = [&](const std::string& token, const std::string& origin) {
    WebConfig config;
    config.address = {"127.0.0.1", 0, true};
    config.token = token;
    config.public_origin = origin;
    return std::make_unique<WebServer>(config, feed);
  };
  const std::string token = "0123456789abcdef", authorized = "Authorization: Bearer " + token + "\r\n";
  CHECK(error_of([&] { serve("", "https://rig.example"); }).status == Status::bad_config);
  for (const char* wrong : {"rig.example", "https://", "https://rig.example/", "ftp://rig.example"})
    CHECK_MESSAGE(error_of([&] { serve(token, wrong); }).status == Status::bad_config, wrong);
  const auto server = serve(token, "https://Rig.example");
  CHECK(server->url() == "https://rig.example/?token=" + token);
  const std::string own = "127.0.0.1:" + std::to_string(server->port());
  // Proxies pass the browser's Host header on, or put in their own address of the page.
  for (const std::string& host : {std::string("rig.example"), own}) {
    CAPTURE(host);
    CHECK(status_of(RawClient(server->port()).ask("GET /", authorized, host)) == "HTTP/1.1 200 OK");
    const auto upgrade = [&](const std::string& origin) {
      return status_of(RawClient(server->port()).upgrade("Origin: " + origin + "\r\n" + authorized, host));
    };
    CHECK(upgrade("https://rig.example") == "HTTP/1.1 101 Switching Protocols");
    CHECK(upgrade("https://evil.example") == "HTTP/1.1 403 Forbidden");
  }
  CHECK(status_of(RawClient(server->port()).ask("GET /", "", "rig.example")) == "HTTP/1.1 401 Unauthorized");
  CHECK(status_of(RawClient(server->port()).ask("GET /", authorized, "rig.example.evil")) == "HTTP/1.1 403 Forbidden");
}

TEST_CASE("a second server on the same port gets an error") {
  Bench bench;
  FakeFeed feed;
  const Error error = error_of([&] { WebServer({{"127.0.0.1", bench.server.port(), true}, {}, "", {}}, feed); });
  check_error(error, Status::endpoint_unavailable, {std::to_string(bench.server.port())});
}

TEST_CASE("requests that are too large or incomplete are ended") {
  Bench bench({.request_timeout = 1s});
  RawClient large(bench.server.port());
  large.send("GET / HTTP/1.1\r\nHost: " + large.host() + "\r\nX: " + std::string(100'000, 'x') + "\r\n\r\n");
  CHECK(!contains(large.receive(SIZE_MAX), "200 OK"));
  RawClient body(bench.server.port());
  body.send("GET / HTTP/1.1\r\nHost: " + body.host() + "\r\nContent-Length: 1000000\r\n\r\n" + std::string(1000, 'x'));
  CHECK(!contains(body.receive(SIZE_MAX), "200 OK"));
  RawClient slow(bench.server.port());
  slow.send("GET / HT");
  const auto begin = std::chrono::steady_clock::now();
  CHECK(slow.receive(SIZE_MAX).empty());
  CHECK(std::chrono::steady_clock::now() - begin < 10s);
  RawClient garbage(bench.server.port());
  garbage.send(std::string(4096, '\xff'));
  CHECK(!contains(garbage.receive(SIZE_MAX), "200 OK"));
  CHECK(status_of(bench.client().ask("GET /")) == "HTTP/1.1 200 OK");
}

TEST_CASE("watchers and connections are limited, and closing them makes room") {
  Bench bench({.connections = 8, .watchers = 2});
  {
    RawClient first(bench.server.port()), second(bench.server.port());
    CHECK(status_of(first.upgrade()) == "HTTP/1.1 101 Switching Protocols");
    CHECK(status_of(second.upgrade()) == "HTTP/1.1 101 Switching Protocols");
    CHECK(bench.server.watchers() == 2);
    CHECK(status_of(bench.client().upgrade()) == "HTTP/1.1 503 Service Unavailable");
  }
  CHECK(eventually([&] { return bench.server.watchers() == 0; }));
  CHECK(eventually([&] { return status_of(bench.client().ask("GET /")) == "HTTP/1.1 200 OK"; }));
}

// Regression: connections with half a request held all places for ten seconds, and again after that.
TEST_CASE("half requests do not keep others out: the longest waiting one of them makes room") {
  Bench bench({.connections = 8, .watchers = 2, .request_timeout = 60s}, "0123456789abcdef", "0.0.0.0");
  RawClient watcher(bench.server.port());
  const std::string authorized = "Authorization: Bearer 0123456789abcdef\r\n";
  CHECK(status_of(watcher.upgrade(authorized)) == "HTTP/1.1 101 Switching Protocols");
  CHECK(watcher.next_message() == "rows");
  std::vector<std::unique_ptr<RawClient>> halves;
  for (int round = 0; round < 20; ++round) {
    for (int i = 0; i < 10; ++i) {
      halves.push_back(std::make_unique<RawClient>(bench.server.port()));
      halves.back()->send("GET / HTTP/1.1\r\n");
    }
    CHECK(status_of(bench.client().ask("GET /", authorized)) == "HTTP/1.1 200 OK");
  }
  CHECK(halves.front()->receive(SIZE_MAX).empty());  // closed
  bench.server.publish(std::make_shared<const std::string>("snapshot"));
  CHECK(watcher.next_message() == "snapshot");
}

TEST_CASE("a watcher gets the rows and the newest snapshot; it is disconnected when it sends") {
  Bench bench;
  RawClient watcher(bench.server.port());
  REQUIRE(status_of(watcher.upgrade()) == "HTTP/1.1 101 Switching Protocols");
  CHECK(watcher.next_message() == "rows");
  bench.server.publish(std::make_shared<const std::string>("snapshot"));
  CHECK(watcher.next_message() == "snapshot");
  watcher.send(std::string("\x82\x81\x00\x00\x00\x00x", 7));
  CHECK(watcher.receive(SIZE_MAX).empty());
  CHECK(eventually([&] { return bench.server.watchers() == 0; }));
}

TEST_CASE("32 watchers that never read: publishing does not wait, memory is bounded, others get the newest snapshot") {
  Bench bench({.silence = 60s});
  std::vector<std::unique_ptr<RawClient>> stalled;
  for (int i = 0; i < 32; ++i) {
    stalled.push_back(std::make_unique<RawClient>(bench.server.port(), 4096));
    REQUIRE(status_of(stalled.back()->upgrade()) == "HTTP/1.1 101 Switching Protocols");
  }
  RawClient reader(bench.server.port());
  REQUIRE(status_of(reader.upgrade()) == "HTTP/1.1 101 Switching Protocols");
  std::string last;
  std::thread reading([&] {
    while (!last.starts_with("end")) {
      last = reader.next_message();
      if (last.empty()) break;
    }
  });
  constexpr std::size_t snapshot_bytes = 4'000'000, rounds = 300;
  const std::size_t before = resident_kb();
  std::size_t most = 0;
  for (std::size_t i = 0; i < rounds; ++i) {
    bench.server.publish(std::make_shared<const std::string>(snapshot_bytes, static_cast<char>('a' + i % 3)));
    std::this_thread::sleep_for(2ms);
    most = std::max(most, resident_kb());
  }
  bench.server.publish(std::make_shared<const std::string>("end" + std::string(100, '.')));
  reading.join();
  CHECK(last.starts_with("end"));
  CHECK(bench.server.watchers() == 33);
  // Each stalled watcher may hold one snapshot, possibly a different one; without a bound it would be 300 each.
  CHECK(most - std::min(most, before) < 2 * 33 * snapshot_bytes / 1024);
}

TEST_CASE("snapshots are awaited only while a watcher has received everything") {
  Bench bench({.silence = 60s});
  CHECK(!bench.server.is_awaited());
  const auto snapshot = std::make_shared<const std::string>(8'000'000, 's');
  {
    RawClient stalled(bench.server.port(), 4096);
    REQUIRE(status_of(stalled.upgrade()) == "HTTP/1.1 101 Switching Protocols");
    CHECK(eventually([&] { return bench.server.is_awaited(); }));
    bench.server.publish(snapshot);
    CHECK(eventually([&] { return !bench.server.is_awaited(); }));
    std::this_thread::sleep_for(200ms);
    CHECK(!bench.server.is_awaited());
    RawClient reader(bench.server.port());
    REQUIRE(status_of(reader.upgrade()) == "HTTP/1.1 101 Switching Protocols");
    CHECK(reader.next_message() == *snapshot);  // whole, in one frame
    CHECK(reader.next_message() == "rows");
    CHECK(eventually([&] { return bench.server.is_awaited(); }));
  }
  CHECK(eventually([&] { return bench.server.watchers() == 0; }));
  CHECK(!bench.server.is_awaited());
}

TEST_CASE("watchers that answer no ping are disconnected") {
  Bench bench({.silence = 1s});
  RawClient dead(bench.server.port());
  REQUIRE(status_of(dead.upgrade()) == "HTTP/1.1 101 Switching Protocols");
  CHECK(eventually([&] { return bench.server.watchers() == 0; }));
}
