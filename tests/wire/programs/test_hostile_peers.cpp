// Peers that break ZeroMQ's protocol, against lbea-serve as a process: it survives, cuts them off, and names them.
#include "adapters/wire/sockets/streams.hpp"
#include "tests/wire/programs/serve_bench.hpp"
#include "tests/wire/raw_peer.hpp"

using namespace lbea;
using namespace lbea::wire;
using namespace std::chrono_literals;
using lbea::test::contains;
using lbea::test::eventually;
using lbea::test::RawPeer;
using lbea::test::ServeBench;
using lbea::test::text_of;

namespace {

constexpr std::size_t megabyte = 1'000'000;

/// A build with LBEA_SYSTEM_ZMQ promises nothing of this.
bool is_promised() {
  if (!has_peer_bounds()) MESSAGE("not tested: the system's libzmq");
  return has_peer_bounds();
}

/// The log line about a peer in this process.
bool is_named(const ServeBench& bench, const std::string& endpoint, const std::string& offense) {
  const std::string peer =
      "localhost:" + std::to_string(::getuid()) + ":" + std::to_string(::getgid()) + ":" + std::to_string(::getpid());
  return eventually([&] {
    const std::string text = bench.said();
    return contains(text, endpoint + ": cut off ") && contains(text, "from " + peer + ", sent " + offense);
  });
}

void check_serves(ServeBench& bench, test::Process& server) {
  REQUIRE(server.is_running());
  CHECK(bench.send() == 0);
  server.signal(SIGINT);
  CHECK(server.wait() == 0);
}

}  // namespace

TEST_CASE("a PING left by a peer that has gone does not end the matcher (libzmq: Assertion failed: !_io_error)") {
  if (!is_promised()) return;
  ServeBench bench;
  const auto server = bench.serve({"--queue", "1"});
  std::string bytes;
  for (int i = 0; i < 40; ++i) bytes += RawPeer::part("not a frame");
  bytes += RawPeer::part(std::string("\x04PING\0\0context", 14), RawPeer::command);
  bytes += RawPeer::part("\x04PING", RawPeer::command);  // shorter than its fixed part
  for (int i = 0; i < 10 && server->is_running(); ++i) {
    RawPeer peer(bench.frames);
    peer.become("PUSH");
    for (int k = 0; k < 20; ++k) peer.send(bytes);
  }
  check_serves(bench, *server);
}

TEST_CASE("more connections than descriptors do not end the matcher, and leave it descriptors for its files") {
  if (!is_promised()) return;
  ServeBench bench;
  const auto server = bench.start(
      "/usr/bin/prlimit",
      {"--nofile=80", LBEA_SERVE, LBEA_MODEL, "--frames", bench.frames, "--results", bench.results, "--json"}, "serve");
  REQUIRE(eventually([&] { return contains(bench.said(), "ready: frames on "); }));
  {
    std::vector<std::unique_ptr<RawPeer>> crowd;
    for (int i = 0; i < 150 && server->is_running(); ++i)
      CHECK(crowd.emplace_back(std::make_unique<RawPeer>(i % 2 == 0 ? bench.frames : bench.results))->is_connected());
    CHECK(eventually([&] { return contains(bench.said(), "connections because few descriptors are left"); }));
  }
  check_serves(bench, *server);
}

TEST_CASE("a message of endless parts is cut off (it was stored without a bound: 4 GB in 20 s)") {
  if (!is_promised()) return;
  for (const std::string endpoint : {"frames", "results", "preview"}) {
    CAPTURE(endpoint);
    ServeBench bench;
    const auto server = bench.serve({"--preview", "ipc://" + bench.file("preview")});
    RawPeer peer("ipc://" + bench.file(endpoint));
    peer.become(endpoint == "frames" ? "PUSH" : "SUB");
    CHECK(peer.is_cut_off(RawPeer::part("\x01" + std::string(200, 'x'), RawPeer::more), 20 * megabyte));
    CHECK(is_named(bench, endpoint, "a message of several parts"));
    check_serves(bench, *server);
  }
}

TEST_CASE("a listener that subscribes without end is cut off, and the others keep their results") {
  if (!is_promised()) return;
  ServeBench bench;
  const auto server = bench.serve();
  WireContext context;
  ResultSource listener(context, bench.results);
  REQUIRE(listener.receive(30s));
  RawPeer peer(bench.results);
  peer.become("SUB");
  CHECK(peer.is_cut_off(RawPeer::part("\x01topic"), 20 * megabyte));
  CHECK(is_named(bench, "results", "too many subscriptions"));
  while (listener.receive(0ms)) {}
  CHECK(listener.receive(30s));
  check_serves(bench, *server);
}

TEST_CASE("a sender of too large a message is named") {
  if (!is_promised()) return;
  ServeBench bench;
  const auto server = bench.serve();
  RawPeer peer(bench.frames);
  peer.become("PUSH");
  peer.send(std::string{2, 0x7f} + std::string(7, '\0'));
  CHECK(is_named(bench, "frames", "a message above the size limit"));
  check_serves(bench, *server);
}

TEST_CASE("before its handshake ends a stranger cannot have a large message stored") {
  if (!is_promised()) return;
  ServeBench bench;
  const auto server = bench.serve();
  RawPeer peer(bench.frames);
  peer.greet();
  peer.send(std::string{RawPeer::command | 2} + std::string{'\0', '\0', '\0', '\0', '\0', 0x10, '\0', '\0'});  // 1 MiB
  // Slowly: the system may hold a megabyte before the matcher reads any of it.
  CHECK(peer.is_cut_off(std::string(10'000, 'x'), megabyte, std::chrono::milliseconds(2)));
  check_serves(bench, *server);
}
