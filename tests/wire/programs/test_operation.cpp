// lbea-serve as a process: keys end to end, metrics, systemd notifications, --check, restarts, unauthorized
// connections.
#include "adapters/wire/codec/codec.hpp"
#include "adapters/wire/sockets/streams.hpp"
#include "tests/support/test_data.hpp"
#include "tests/wire/programs/serve_bench.hpp"

#include <doctest/doctest.h>

#include <algorithm>
#include <cstdlib>
#include <fstream>
#include <random>

#include <arpa/inet.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>

using namespace lbea;
using namespace lbea::wire;
using namespace std::chrono_literals;
using lbea::test::contains;
using lbea::test::eventually;
using lbea::test::Process;
using lbea::test::ServeBench;
using lbea::test::text_of;

namespace {

bool is_long_run() { return std::getenv("LBEA_LONG_TESTS") != nullptr; }

int connected_to(const std::string& address) {
  const int socket = ::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
  sockaddr_in to{};
  to.sin_family = AF_INET;
  to.sin_port = htons(static_cast<std::uint16_t>(std::stoul(address.substr(address.rfind(':') + 1))));
  to.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  static_cast<void>(::connect(socket, reinterpret_cast<const sockaddr*>(&to), sizeof to));
  return socket;
}

std::string answer_to(const std::string& address, const std::string& request) {
  const int socket = connected_to(address);
  static_cast<void>(::send(socket, request.data(), request.size(), MSG_NOSIGNAL));
  std::string answer(1 << 16, '\0');
  std::size_t size = 0;
  for (ssize_t got = 1; got > 0 && size < answer.size(); size += static_cast<std::size_t>(std::max<ssize_t>(got, 0)))
    got = ::recv(socket, answer.data() + size, answer.size() - size, 0);
  ::close(socket);
  answer.resize(size);
  return answer;
}

std::string page_of(const std::string& address) {
  return answer_to(address, "GET /metrics HTTP/1.1\r\nHost: localhost\r\n\r\n");
}

double value_of(const std::string& page, const std::string& metric) {
  const auto at = page.find("\n" + metric + " ");
  REQUIRE(at != std::string::npos);
  return std::stod(page.substr(at + metric.size() + 2));
}

/// A process that keeps 1,000 connections open, idle or sending noise, and reopens a thousand per second.
int start_crowd(const std::string& frames) {
  const int crowd = ::fork();
  if (crowd != 0) return crowd;
  std::vector<int> connections;
  std::mt19937 random(3);
  for (std::uint64_t i = 0;; ++i) {
    if (connections.size() == 1000) {
      ::close(connections.front());
      connections.erase(connections.begin());
    }
    connections.push_back(connected_to(frames));
    std::string noise(random() % 200, '\0');
    for (char& c : noise) c = static_cast<char>(random());
    if (i % 2 == 0) static_cast<void>(::send(connections.back(), noise.data(), noise.size(), MSG_NOSIGNAL));
    ::usleep(i < 1000 ? 100 : 1000);
  }
}

/// systemd's notification socket.
class ServiceManager {
 public:
  explicit ServiceManager(const std::string& path) : socket_(::socket(AF_UNIX, SOCK_DGRAM | SOCK_CLOEXEC, 0)) {
    sockaddr_un address{};
    address.sun_family = AF_UNIX;
    path.copy(address.sun_path, sizeof address.sun_path - 1);
    REQUIRE(::bind(socket_, reinterpret_cast<const sockaddr*>(&address), sizeof address) == 0);
    const timeval timeout{0, 100'000};
    ::setsockopt(socket_, SOL_SOCKET, SO_RCVTIMEO, &timeout, sizeof timeout);
  }
  ~ServiceManager() { ::close(socket_); }
  std::string receive() {
    std::string text(4096, '\0');
    const ssize_t got = ::recv(socket_, text.data(), text.size(), 0);
    text.resize(got > 0 ? static_cast<std::size_t>(got) : 0);
    return text;
  }
  bool receives(const std::string& words) {
    return eventually([&] { return contains(receive(), words); });
  }
  void discard() {
    while (!receive().empty()) {}
  }

 private:
  int socket_;
};

}  // namespace

TEST_CASE("with keys, only allowed peers are served, end to end") {
  ServeBench bench;
  for (const std::string name : {"matcher", "camera", "stranger"}) bench.make_key(name);
  bench.frames = bench.results = "tcp://127.0.0.1:*";
  const auto server = bench.serve({"--key", bench.file("matcher.key"), "--allow", bench.file("camera.pub")});
  const std::string results = bench.word_after("results on ");
  const std::vector<std::string> as_camera{
      "--results", results, "--server-key", bench.file("matcher.pub"), "--key", bench.file("camera.key")};
  CHECK(bench.send(as_camera) == 0);
  CHECK(contains(text_of(bench.file("send.out")),
                 "\"receipt\":{\"received\":1,\"withheld\":0,\"missed\":0,\"dropped\":0}"));
  CHECK(bench.send({"--server-key", bench.file("matcher.pub"), "--key", bench.file("stranger.key")}) == 1);
  CHECK(contains(text_of(bench.file("send.err")), "nobody who knows this program's key"));
  CHECK(bench.send() == 1);
  CHECK(bench.send({"--key", bench.file("camera.key")}) == 2);  // no --server-key
  CHECK(bench.send({"--server-key", bench.file("matcher.pub"), "--key", bench.file("camera.pub")}) == 1);
  CHECK(eventually([&] {
    return contains(bench.said(), "frames: camera connected from 127.0.0.1") &&
           contains(bench.said(), "without an allowed key (--allow), one of them from 127.0.0.1");
  }));
  server->signal(SIGINT);
  CHECK(server->wait() == 0);
  CHECK(contains(text_of(bench.file("serve.out")), "\"captured\":1,\"received\":1,\"matched\":1"));
}

// Regression: every allowed key could send frames.
TEST_CASE("a key that may only listen receives results and cannot send frames") {
  ServeBench bench;
  for (const std::string name : {"matcher", "camera", "viewer"}) bench.make_key(name);
  bench.frames = bench.results = "tcp://127.0.0.1:*";
  const auto server = bench.serve({"--key", bench.file("matcher.key"), "--allow", bench.file("camera.pub"),
                                   "--allow-listen", bench.file("viewer.pub")});
  const std::string matcher = bench.file("matcher.pub");
  CHECK(bench.send({"--server-key", matcher, "--key", bench.file("viewer.key")}) == 1);
  const auto keys = [&](const std::string& name) {
    return ClientAccess{read_public_keys(matcher).front().public_key, read_key_pair(bench.file(name + ".key"))};
  };
  for (const std::string name : {"viewer", "camera"}) {
    CAPTURE(name);
    WireContext context;
    ResultSource results(context, bench.word_after("results on "), 16, keys(name));
    CHECK(results.receive(30s));
  }
  CHECK(bench.send({"--server-key", matcher, "--key", bench.file("camera.key")}) == 0);
  server->signal(SIGINT);
  CHECK(server->wait() == 0);
  CHECK(contains(text_of(bench.file("serve.out")), "\"captured\":1,\"received\":1,\"matched\":1"));
}

TEST_CASE("unsafe settings are rejected at the start") {
  ServeBench bench;
  for (const std::string name : {"matcher", "camera"}) bench.make_key(name);
  const auto refused = [&](std::vector<std::string> more, const std::string& sentence) {
    std::vector<std::string> arguments{LBEA_MODEL, "--results", bench.results};
    arguments.insert(arguments.end(), more.begin(), more.end());
    CHECK(bench.start(LBEA_SERVE, arguments, "serve")->wait() == 1);
    CAPTURE(bench.said());
    CHECK(contains(bench.said(), sentence));
  };
  const std::string key = bench.file("matcher.key"), pub = bench.file("camera.pub");
  refused({"--frames", "tcp://0.0.0.0:5555"}, "without keys only this machine");
  refused({"--frames", "tcp://0.0.0.0:5555", "--key", key}, "give --allow");
  refused({"--frames", "tcp://0.0.0.0:5555", "--allow", pub}, "give --key");
  refused({"--frames", bench.frames, "--metrics", "0.0.0.0:9464"}, "only this machine may");
  refused({"--frames", bench.frames, "--metrics", "127.0.0.1:nine"}, "the port is not a number from 0 to 65535");
  std::ofstream(bench.file("empty.pub")) << "# nobody\n";
  refused({"--frames", "tcp://0.0.0.0:5555", "--key", key, "--allow", bench.file("empty.pub")}, "no public key");
  ::chmod(key.c_str(), 0644);
  refused({"--frames", "tcp://0.0.0.0:5555", "--key", key, "--allow", pub}, "chmod 600");
}

TEST_CASE("a lost frame shows in the result stream, the log, the metrics and the exit code") {
  ServeBench bench;
  const auto server = bench.serve({"--metrics", "127.0.0.1:0"});
  std::string metrics;
  REQUIRE(eventually([&] { return contains(bench.said(), "metrics on http://"); }));
  metrics = bench.word_after("metrics on http://");
  metrics = metrics.substr(0, metrics.find('/'));
  WireContext context;
  ResultSource results(context, bench.results);
  FrameSink sink(context, bench.frames);
  REQUIRE(results.receive(30s));
  REQUIRE(sink.wait_ready(30s));
  Encoder encoder;
  const std::vector<Point> points{{1, 2, 3}};
  for (const std::uint64_t id : {0u, 1u, 4u}) REQUIRE(sink.send(encoder.frame({id, 0, points}, 9), 30s));
  REQUIRE(sink.tell(encoder.end_of_stream(9, 5), 30s));
  std::vector<std::uint64_t> missed;
  WireResult result;
  while (result.status != WireStatus::end_of_stream) {
    const auto message = results.receive(30s);
    REQUIRE(message);
    if (decode_result(*message, result) == WireStatus::ok && result.status == WireStatus::missed)
      missed.push_back(result.frame_id);
  }
  CHECK(missed == std::vector<std::uint64_t>{2, 3});
  CHECK(result.counters.missed == 2);
  CHECK(eventually([&] { return contains(bench.said(), "frame 2: missed"); }));
  const std::string page = page_of(metrics);
  CHECK(contains(page, "HTTP/1.1 200 OK"));
  CHECK(value_of(page, "lbea_frames_total{fate=\"dropped\",status=\"missed\"}") == 2);
  CHECK(value_of(page, "lbea_frames_captured_total") == 5);
  CHECK(value_of(page, "lbea_peers{endpoint=\"frames\"}") == 1);
  CHECK(value_of(page, "lbea_frames_on_the_way") == 0);
  server->signal(SIGTERM);
  CHECK(server->wait() == 1);
  CHECK(contains(text_of(bench.file("serve.out")), "\"missed\":2"));
}

TEST_CASE("metrics: read only, local host names only, and unaffected by a crowd of connections") {
  ServeBench bench;
  const auto server = bench.serve({"--metrics", "127.0.0.1:0"});
  REQUIRE(eventually([&] { return contains(bench.said(), "metrics on http://"); }));
  std::string metrics = bench.word_after("metrics on http://");
  metrics = metrics.substr(0, metrics.find('/'));
  const auto status = [&](const std::string& request) { return answer_to(metrics, request).substr(0, 12); };
  CHECK(status("GET /metrics HTTP/1.1\r\nHost: 127.0.0.1\r\n\r\n") == "HTTP/1.1 200");
  CHECK(status("HEAD / HTTP/1.1\r\nHost: localhost\r\n\r\n") == "HTTP/1.1 200");
  CHECK(status("GET /metrics HTTP/1.1\r\nHost: [::1]:9464\r\n\r\n") == "HTTP/1.1 200");
  // Regression: names that begin like an address of this machine were taken for one.
  for (const char* host : {"evil.example", "127.evil.example:9464", "127.0.0.1.evil.example", "[::1].evil", "127."})
    CHECK_MESSAGE(status("GET /metrics HTTP/1.1\r\nHost: " + std::string(host) + "\r\n\r\n") == "HTTP/1.1 403", host);
  CHECK(status("GET /etc/passwd HTTP/1.1\r\nHost: localhost\r\n\r\n") == "HTTP/1.1 404");
  CHECK(status("DELETE /metrics HTTP/1.1\r\nHost: localhost\r\n\r\n") == "HTTP/1.1 405");
  CHECK(status("GET /" + std::string(20'000, 'a') + " HTTP/1.1\r\n\r\n").empty());
  CHECK(status("nonsense\r\n\r\n").empty());
  std::vector<int> crowd;
  for (int i = 0; i < 100; ++i) crowd.push_back(connected_to(metrics));
  CHECK(bench.send() == 0);
  for (const int socket : crowd) ::close(socket);
  CHECK(eventually([&] { return contains(page_of(metrics), "lbea_frames_received_total 1"); }));
  server->signal(SIGINT);
  CHECK(server->wait() == 0);
}

TEST_CASE("systemd is notified of ready, alive and stopping, and of nothing while the process is suspended") {
  ServeBench bench;
  ServiceManager manager(bench.file("notify"));
  ::setenv("NOTIFY_SOCKET", bench.file("notify").c_str(), 1);
  ::setenv("WATCHDOG_USEC", "2000000", 1);
  const auto server = bench.serve();
  ::unsetenv("NOTIFY_SOCKET");
  ::unsetenv("WATCHDOG_USEC");
  CHECK(manager.receives("READY=1"));
  CHECK(manager.receives("WATCHDOG=1"));
  CHECK(manager.receives("STATUS=captured 0"));
  server->signal(SIGSTOP);
  std::this_thread::sleep_for(200ms);
  manager.discard();
  CHECK(manager.receive().empty());
  server->signal(SIGCONT);
  CHECK(manager.receives("WATCHDOG=1"));
  server->signal(SIGTERM);
  CHECK(manager.receives("STOPPING=1"));
  CHECK(server->wait() == 0);
}

TEST_CASE("--check finds problems, changes nothing, and prints JSON") {
  ServeBench bench;
  const auto check = [&](std::vector<std::string> more) {
    std::vector<std::string> arguments{LBEA_MODEL, "--check", "--json"};
    arguments.insert(arguments.end(), more.begin(), more.end());
    return bench.start(LBEA_SERVE, arguments, "check")->wait();
  };
  const auto found = [&] { return text_of(bench.file("check.out")); };
  CHECK(check({"--frames", bench.frames, "--results", bench.results, "--metrics", "127.0.0.1:0", "--record",
               bench.file("run.mcap"), "--pin", "0", "--realtime", "1", "--lock-memory"}) == 0);
  for (const std::string name :
       {"model", "keys", "frames", "results", "metrics", "memory", "pin", "realtime", "lock-memory", "clock", "disk"}) {
    CAPTURE(name);
    CHECK(contains(found(), "{\"name\":\"" + name + "\""));
  }
  CHECK(contains(found(), "\"passed\":true"));
  for (const std::string name : {"frames", "frames.lock", "results", "run.mcap"})
    CHECK_FALSE(std::filesystem::exists(bench.file(name)));
  CHECK(check({"--frames", "tcp://0.0.0.0:1", "--results", bench.results}) == 1);
  CHECK(contains(found(), "\"name\":\"frames\",\"level\":\"failed\""));
  CHECK(check({"--frames", bench.frames, "--results", bench.results, "--record", "/no/such/folder/run.mcap"}) == 1);
  CHECK(contains(found(), "\"name\":\"disk\",\"level\":\"failed\""));
  CHECK(check({"--frames", bench.frames, "--results", bench.results, "--pin", "100000"}) ==
        0);  // requested, not granted, not fatal
  CHECK(contains(found(), "\"name\":\"pin\",\"level\":\"warning\""));
  // Regression: without --pose no frame gets a verdict, and only the start warned of it.
  CHECK(check({"--frames", bench.frames, "--results", bench.results}) == 0);
  CHECK(contains(found(), "\"name\":\"method\",\"level\":\"warning\""));
  // Regression: the check did not test the requirements of fit, and the start failed after it had passed.
  const std::vector<std::string> fit{"--frames", bench.frames, "--results", bench.results, "--method", "fit"};
  const auto fit_and = [&](std::vector<std::string> more) {
    more.insert(more.begin(), fit.begin(), fit.end());
    return check(std::move(more));
  };
  CHECK(fit_and({}) == 1);  // the model's images were rendered for another pose
  CHECK(contains(found(), "\"name\":\"fit\",\"level\":\"failed\""));
  CHECK(fit_and({"--pose", LBEA_SENSOR, "--infer", "plastic_strain", "--inference",
                 "ipc://" + bench.file("inference")}) == 0);
  CHECK(fit_and({"--pose", LBEA_SENSOR, "--infer", "bogus", "--inference", "ipc://" + bench.file("inference")}) == 1);
  CHECK(contains(found(), "\"name\":\"infer\",\"level\":\"failed\""));
  CHECK(fit_and({"--pose", LBEA_SENSOR, "--infer", "plastic_strain", "--inference", "tcp://0.0.0.0:1"}) == 1);
  CHECK(contains(found(), "\"name\":\"inference\",\"level\":\"failed\""));
  // Regression: the check passed a recording's name that exists and an invalid window, which the start rejects.
  std::ofstream(bench.file("taken.mcap")) << "of yesterday";
  for (const std::vector<std::string>& recording : {std::vector<std::string>{"--record", bench.file("taken.mcap")},
                                                    {"--record", bench.folder.path().string()},
                                                    {"--record", bench.file("x.mcap"), "--record-window", "nan:2"}}) {
    std::vector<std::string> more{"--frames", bench.frames, "--results", bench.results};
    more.insert(more.end(), recording.begin(), recording.end());
    CHECK(check(more) == 1);
    CHECK(contains(found(), "\"name\":\"record\",\"level\":\"failed\""));
  }
  CHECK(check({"--frames", bench.frames, "--results", bench.results, "--record-window", "0.5:2"}) ==
        2);  // a window without --record
  for (const std::string number : {"010", "0x10", "99999999999999999999",
                                   "-9223372036854775809"}) {  // not octal, not hexadecimal, not out of range
    CAPTURE(number);
    CHECK(check({"--frames", bench.frames, "--results", bench.results, "--trigger-ns=" + number}) == 2);
  }
  CHECK(check({"--frames", bench.frames, "--results", bench.results, "--trigger-ns=-9223372036854775808"}) == 0);
  const auto server = bench.serve();
  CHECK(check({"--frames", bench.frames, "--results", "ipc://" + bench.file("other")}) == 1);
  // Regression: a file name in another encoding ended the check with an error of the JSON library.
  const std::string latin = bench.file(
      "k\xFC"
      "che.lbea");
  std::filesystem::copy_file(LBEA_MODEL, latin);
  const test::Outcome said = test::run_program(LBEA_SERVE " '" + latin + "' --check --json --frames ipc://" +
                                                   bench.file("a") + " --results ipc://" + bench.file("b"),
                                               bench.folder.path());
  CHECK(said.exit_code == 0);
  CHECK(contains(said.out,
                 "k\xEF\xBF\xBD"
                 "che.lbea: "));
  CHECK(contains(found(), "in use by another process"));
  CHECK(bench.send() == 0);  // the running server was not disturbed
  server->signal(SIGINT);
  CHECK(server->wait() == 0);
}

TEST_CASE("privileges that are not granted are logged and not fatal") {
  ServeBench bench;
  const auto server = bench.serve({"--pin", "100000"});
  CHECK(eventually([&] { return contains(bench.said(), "--pin: processor 100000 is not available"); }));
  CHECK(bench.send() == 0);
  server->signal(SIGINT);
  CHECK(server->wait() == 0);
}

TEST_CASE("killed and restarted repeatedly, it always starts quickly and serves") {
  ServeBench bench;
  const int cycles = is_long_run() ? 1000 : 50;
  std::mt19937 random(11);
  std::vector<double> seconds;
  for (int cycle = 0; cycle < cycles; ++cycle) {
    std::filesystem::remove(bench.file("serve.err"));
    const auto begin = std::chrono::steady_clock::now();
    const auto server = bench.serve();
    seconds.push_back(std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count());
    if (cycle % 10 == 0) CHECK(bench.send() == 0);
    std::this_thread::sleep_for(std::chrono::microseconds(random() % 20'000));
    server->signal(SIGKILL);
    CHECK(server->wait() == 128 + SIGKILL);
  }
  std::ranges::sort(seconds);
  MESSAGE(cycles << " starts after kill -9, ready after " << seconds[seconds.size() / 2]
                 << " s in the median, the slowest after " << seconds.back() << " s");
}

// 1,000 unauthorized connections must not reduce an admitted sender's rate. Windows with and without them alternate, so
// that other load on the machine affects both.
TEST_CASE("a crowd of unauthorized connections does not slow an admitted sender") {
  ServeBench bench;
  for (const std::string name : {"matcher", "camera"}) bench.make_key(name);
  bench.frames = bench.results = "tcp://127.0.0.1:*";
  const auto server = bench.serve({"--key", bench.file("matcher.key"), "--allow", bench.file("camera.pub")});
  const std::string frames = bench.word_after("frames on ");
  WireContext context;
  FrameSink sink(context, frames, 16,
                 {read_public_keys(bench.file("matcher.pub"))[0].public_key, read_key_pair(bench.file("camera.key"))});
  REQUIRE(sink.wait_ready(30s));
  Encoder encoder;
  const std::vector<Point> points(1000, Point{1, 2, 3});
  std::uint64_t id = 0;
  const auto share_sent = [&] {  // of 500 frames at 500/s without waiting
    std::uint64_t sent = 0;
    const auto begin = std::chrono::steady_clock::now();
    for (int i = 0; i < 500; ++i) {
      std::this_thread::sleep_until(begin + i * 2ms);
      sent += sink.send(encoder.frame({id++, 0, points}, 4)) ? 1u : 0u;
    }
    return static_cast<double>(sent) / 500;
  };
  double beside = 0, alone = 0;
  const int pairs = is_long_run() ? 20 : 1;
  for (int pair = 0; pair < pairs; ++pair) {
    const int crowd = start_crowd(frames);
    std::this_thread::sleep_for(1s);
    beside += share_sent() / pairs;
    ::kill(crowd, SIGKILL);
    ::waitpid(crowd, nullptr, 0);
    alone += share_sent() / pairs;
  }
  MESSAGE("sent of those due: " << alone << " alone, " << beside << " beside a crowd, in " << pairs
                                << " pairs of windows");
  CHECK(beside >= 0.99 * alone);
  REQUIRE(sink.tell(encoder.end_of_stream(4, id), 30s));
  CHECK(sink.flush(30s) == 0);
  server->signal(SIGTERM);
  static_cast<void>(server->wait());
  CHECK(contains(text_of(bench.file("serve.out")), "\"adds_up\":true"));
  CHECK(contains(text_of(bench.file("serve.out")), "\"wrong_kind\":0"));
}
