// Access control with real sockets: key files, allow-list, limits, unauthorized connections.
#include "adapters/wire/codec/codec.hpp"
#include "adapters/wire/sockets/streams.hpp"
#include "tests/support/files.hpp"
#include "tests/support/test_data.hpp"
#include "tests/wire/wire_support.hpp"

#include <doctest/doctest.h>

#include <algorithm>
#include <cstdlib>
#include <random>

#include <arpa/inet.h>
#include <fcntl.h>
#include <sys/socket.h>
#include <sys/stat.h>

using namespace lbea;
using namespace lbea::wire;
using namespace std::chrono_literals;
using lbea::test::check_error;
using lbea::test::contains;
using lbea::test::error_of;
using lbea::test::eventually;
using lbea::test::mentions;
using lbea::test::text_of;

namespace {

struct Parties {
  CurveKeyPair server = generate_key_pair(), camera = generate_key_pair(), stranger = generate_key_pair();
  [[nodiscard]] ServerAccess access(std::uint32_t max_peers = 16) const {
    return {server, {{camera.public_key, "camera"}}, max_peers};
  }
  [[nodiscard]] ClientAccess as(const CurveKeyPair& keys) const { return {server.public_key, keys}; }
};

const std::vector<std::byte> some_bytes(100, std::byte{7});

/// A plain TCP connection that does not speak ZeroMQ.
class Knock {
 public:
  explicit Knock(const std::string& endpoint) : socket_(::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0)) {
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_port = htons(static_cast<std::uint16_t>(std::stoul(endpoint.substr(endpoint.rfind(':') + 1))));
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    static_cast<void>(::connect(socket_, reinterpret_cast<const sockaddr*>(&address), sizeof address));
  }
  ~Knock() { close(); }
  Knock(Knock&& other) noexcept : socket_(std::exchange(other.socket_, -1)) {}
  Knock& operator=(Knock&&) = delete;
  void say(const std::string& text) const {
    static_cast<void>(::send(socket_, text.data(), text.size(), MSG_NOSIGNAL));
  }
  void close() {
    if (socket_ >= 0) ::close(std::exchange(socket_, -1));
  }

 private:
  int socket_;
};

std::string garbage(std::mt19937& random) {
  // ZMTP 3 with an unknown mechanism, ZMTP 1 with a frame, HTTP, noise, and a truncated greeting
  std::string greeting = std::string("\xff") + std::string(8, '\0') + "\x7f\x03\x01";
  switch (random() % 5) {
    case 0:
      return greeting + std::string(80, 'Z');
    case 1:
      return std::string("\x01\x00\x06\x00hello", 9);
    case 2:
      return "GET / HTTP/1.1\r\nHost: rig\r\n\r\n";
    case 3:
      return greeting;
    default:
      break;
  }
  std::string noise(random() % 300, '\0');
  for (char& c : noise) c = static_cast<char>(random());
  return noise;
}

bool delivers(FrameSink& sink, FrameSource& source, std::chrono::milliseconds patience) {
  return sink.send(some_bytes, patience) && source.receive(30s).has_value();
}

mode_t mode_of(const std::filesystem::path& file) {
  struct stat found {};
  REQUIRE(::stat(file.c_str(), &found) == 0);
  return found.st_mode & 0777;
}

void write(const std::filesystem::path& file, const std::string& text, mode_t mode) {
  std::ofstream(file) << text;
  ::chmod(file.c_str(), mode);
}

}  // namespace

TEST_CASE("key files are written, read back, never overwritten; only the owner may read the secret one") {
  const test::TemporaryFolder folder;
  const mode_t before = ::umask(0);
  const CurveKeyPair keys = generate_key_pair();
  write_key_pair(folder / "camera", keys, "camera_1");
  ::umask(before);
  CHECK(mode_of(folder / "camera.key") == 0600);
  CHECK(mode_of(folder / "camera.pub") == 0644);
  CHECK(read_key_pair(folder / "camera.key").secret_key == keys.secret_key);
  CHECK(read_key_pair(folder / "camera.key").public_key == keys.public_key);
  const auto peers = read_public_keys(folder / "camera.pub");
  REQUIRE(peers.size() == 1);
  CHECK(peers[0].public_key == keys.public_key);
  CHECK(peers[0].name == "camera_1");
  CHECK_FALSE(contains(text_of(folder / "camera.pub"), keys.secret_key));
  CHECK(error_of([&] { write_key_pair(folder / "camera", generate_key_pair(), "x"); }).status == Status::write_failed);
  CHECK(read_key_pair(folder / "camera.key").secret_key == keys.secret_key);
  std::filesystem::remove(folder / "camera.key");
  CHECK(error_of([&] { write_key_pair(folder / "camera", keys, "x"); }).status == Status::write_failed);
  CHECK_FALSE(std::filesystem::exists(folder / "camera.key"));  // nothing half done
  CHECK(error_of([&] { write_key_pair(folder / "two", keys, "two words"); }).status == Status::bad_config);
}

TEST_CASE("a secret key that group or others may read is rejected") {
  const test::TemporaryFolder folder;
  write_key_pair(folder / "k", generate_key_pair(), "k");
  for (const mode_t mode : {0640u, 0620u, 0604u, 0602u, 0644u, 0666u, 0610u, 0601u}) {
    CAPTURE(mode);
    ::chmod((folder / "k.key").c_str(), mode);
    const Error error = error_of([&] { static_cast<void>(read_key_pair(folder / "k.key")); });
    check_error(error, Status::bad_config, {"chmod 600"});
  }
  for (const mode_t mode : {0600u, 0400u}) {
    ::chmod((folder / "k.key").c_str(), mode);
    CHECK(read_key_pair(folder / "k.key").secret_key.size() == 40);
  }
}

TEST_CASE("public keys that all users may change are rejected") {
  const test::TemporaryFolder folder;
  write_key_pair(folder / "k", generate_key_pair(), "k");
  for (const mode_t mode : {0644u, 0664u, 0600u, 0440u}) {
    ::chmod((folder / "k.pub").c_str(), mode);
    CHECK(read_public_keys(folder / "k.pub").size() == 1);
  }
  for (const mode_t mode : {0646u, 0666u, 0602u}) {
    ::chmod((folder / "k.pub").c_str(), mode);
    check_error(error_of([&] { static_cast<void>(read_public_keys(folder / "k.pub")); }), Status::bad_config,
                {"chmod o-w"});
  }
}

TEST_CASE("errors name a public key in place of a secret one, and a byte order mark") {
  const test::TemporaryFolder folder;
  write_key_pair(folder / "k", generate_key_pair(), "k");
  check_error(error_of([&] { static_cast<void>(read_key_pair(folder / "k.pub")); }), Status::bad_config,
              {"give the .key file"});
  std::ofstream(folder / "marked.pub") << "\xEF\xBB\xBF" << text_of(folder / "k.pub");
  check_error(error_of([&] { static_cast<void>(read_public_keys(folder / "marked.pub")); }), Status::bad_config,
              {"byte order mark"});
}

TEST_CASE("damaged key files are rejected with the line") {
  const test::TemporaryFolder folder;
  const CurveKeyPair keys = generate_key_pair();
  const std::string good = "lbea-public-key " + keys.public_key + " rig\n";
  const auto refused = [&](const std::string& text, const std::string& why) {
    write(folder / "a.pub", text, 0644);
    const Error error = error_of([&] { static_cast<void>(read_public_keys(folder / "a.pub")); });
    check_error(error, Status::bad_config, {why, "a.pub"});
  };
  refused("", "no public key");
  refused("# only words\n\n", "no public key");
  refused(good + "lbea-public-key " + keys.public_key.substr(1) + "\n", "line 2");
  refused("lbea-public-key " + keys.public_key.substr(1) + " \n", "line 1");
  refused("lbea-public-key " + std::string(40, '"') + "\n", "line 1");
  refused("ssh-rsa " + keys.public_key + "\n", "line 1");
  refused(good + "\n" + "lbea-secret-key " + keys.secret_key + " rig\n", "line 3 is a secret key");
  refused(std::string(2'000'000, '#'), "is not a key file");
  write(folder / "two.pub", "# both cameras\n" + good + "\n" + "lbea-public-key " + generate_key_pair().public_key,
        0644);
  CHECK(read_public_keys(folder / "two.pub").size() == 2);
  write(folder / "wrong.key",
        "lbea-secret-key " + keys.secret_key + " a\nlbea-public-key " + generate_key_pair().public_key + " a\n", 0600);
  CHECK(mentions(error_of([&] { static_cast<void>(read_key_pair(folder / "wrong.key")); }), "do not belong together"));
  write(folder / "none.key", good, 0600);
  CHECK(mentions(error_of([&] { static_cast<void>(read_key_pair(folder / "none.key")); }), "no secret key"));
  const std::string pair = "lbea-secret-key " + keys.secret_key + " a\n";
  write(folder / "twice.key", pair + pair, 0600);
  CHECK(mentions(error_of([&] { static_cast<void>(read_key_pair(folder / "twice.key")); }), "more than one key pair"));
  check_error(error_of([&] { write_key_pair(folder / "nameless", keys, ""); }), Status::bad_config, {"one word"});
  check_error(error_of([&] { write_key_pair(folder / "absent" / "k", keys, "k"); }), Status::write_failed,
              {"cannot be written"});
  {
    const test::FullDisk full(10);
    check_error(error_of([&] { write_key_pair(folder / "full", keys, "k"); }), Status::write_failed,
                {"cannot be written"});
  }
  CHECK_FALSE(std::filesystem::exists(folder / "full.key"));
  CHECK(error_of([&] { static_cast<void>(read_key_pair(folder / "absent.key")); }).status == Status::file_not_found);
  CHECK(error_of([&] { static_cast<void>(read_key_pair(folder.path())); }).status == Status::bad_config);
}

TEST_CASE("remote endpoints need keys and an allow-list") {
  const Parties parties;
  WireContext context;
  for (const std::string address : {"tcp://0.0.0.0:*", "tcp://*:*"}) {
    CAPTURE(address);
    CHECK(error_of([&] { FrameSource source(context, address); }).status == Status::bad_config);
    CHECK(error_of([&] { ResultSink sink(context, address); }).status == Status::bad_config);
    CHECK(error_of([&] {
            FrameSource source(context, address, {}, {parties.server, {}, 16});
          }).status == Status::bad_config);
    CHECK(error_of([&] {
            FrameSource source(context, address, {}, {{}, parties.access().allowed, 16});
          }).status == Status::bad_config);
    CHECK(error_of([&] { FrameSource source(context, address, {}, parties.access()); }).status == Status::ok);
    CHECK(error_of([&] { ResultSink sink(context, address, results_held, parties.access()); }).status == Status::ok);
  }
  // A key without an allow-list is also rejected on this machine: ZeroMQ would admit every key.
  CHECK(error_of([&] {
          FrameSource source(context, "tcp://127.0.0.1:*", {}, {parties.server, {}, 16});
        }).status == Status::bad_config);
}

TEST_CASE("frames are accepted from allowed keys only") {
  const Parties parties;
  const test::TemporaryFolder folder;
  for (const std::string& where : {std::string("tcp://127.0.0.1:*"), "ipc://" + (folder / "f").string()}) {
    CAPTURE(where);
    WireContext context;
    FrameSource source(context, where, {}, parties.access());
    const std::string endpoint = source.endpoint();
    FrameSink camera(context, endpoint, 16, parties.as(parties.camera));
    CHECK(delivers(camera, source, 30s));
    FrameSink stranger(context, endpoint, 16, parties.as(parties.stranger));
    FrameSink nameless(context, endpoint, 16, {parties.server.public_key, {}});
    FrameSink plain(context, endpoint);
    FrameSink misled(context, endpoint, 16,
                     {parties.stranger.public_key, parties.camera});  // takes another for the server
    for (FrameSink* sink : {&stranger, &nameless, &plain, &misled}) CHECK_FALSE(sink->send(some_bytes, 150ms));
    CHECK_FALSE(source.receive(50ms));
    CHECK(source.peers().peers == 1);
    CHECK(source.peers().admitted == 1);
    CHECK(source.peers().unknown >= 2);
    CHECK(source.peers().malformed >= 2);
    CHECK(eventually([&] { return camera.link() == Link::admitted; }));
    for (FrameSink* sink : {&stranger, &nameless}) CHECK(eventually([&] { return sink->link() == Link::refused; }));
    for (FrameSink* sink : {&plain, &misled}) CHECK(eventually([&] { return sink->link() == Link::unusable; }));
    CHECK(delivers(camera, source, 30s));
    std::size_t known = 0, unknown = 0;
    for (const PeerVisit& visit : source.visits()) {
      CHECK(visit.address == (where.starts_with("tcp")
                                  ? "127.0.0.1"
                                  : "localhost:" + std::to_string(::getuid()) + ":" + std::to_string(::getgid()) + ":" +
                                        std::to_string(::getpid())));
      known += visit.answer == PeerVisit::Answer::admitted && visit.name == "camera" ? 1u : 0u;
      unknown += visit.answer == PeerVisit::Answer::unknown && visit.name.empty() ? 1u : 0u;
    }
    CHECK(known == 1);
    CHECK(unknown >= 2);
    CHECK(source.visits().empty());  // told once
  }
}

TEST_CASE("results are sent to allowed keys only") {
  const Parties parties;
  WireContext context;
  ResultSink sink(context, "tcp://127.0.0.1:*", results_held, parties.access());
  ResultSource friendly(context, sink.endpoint(), results_held, parties.as(parties.camera));
  ResultSource stranger(context, sink.endpoint(), results_held, parties.as(parties.stranger));
  ResultSource plain(context, sink.endpoint());
  CHECK(eventually([&] {
    sink.send(some_bytes);
    return friendly.receive(5ms).has_value();
  }));
  for (int i = 0; i < 100; ++i) sink.send(some_bytes);
  CHECK_FALSE(stranger.receive(200ms));
  CHECK_FALSE(plain.receive(50ms));
}

// Regression: the owner of one allowed key could hold all places.
TEST_CASE("one of several keys holds at most half of the places; its later connections take the ones it leaves") {
  const test::TemporaryFolder folder;
  const Parties parties;
  for (const std::string& endpoint : {std::string("tcp://127.0.0.1:*"), "ipc://" + (folder / "frames").string()}) {
    CAPTURE(endpoint);
    WireContext context;
    ServerAccess access = parties.access(4);
    access.allowed.push_back({parties.stranger.public_key, "viewer"});
    FrameSource source(context, endpoint, {}, access);
    std::vector<std::unique_ptr<FrameSink>> viewers;
    const auto connect = [&](const CurveKeyPair& keys) {
      return std::make_unique<FrameSink>(context, source.endpoint(), 16, parties.as(keys));
    };
    for (int i = 0; i < 6; ++i) viewers.push_back(connect(parties.stranger));
    CHECK(eventually([&] { return source.peers().peers == 2 && source.peers().excess >= 4; }));
    const auto camera = connect(parties.camera);
    CHECK(delivers(*camera, source, 30s));
    viewers.clear();
    CHECK(eventually([&] { return source.peers().peers == 1; }));
    const auto again = connect(parties.stranger);
    CHECK(delivers(*again, source, 30s));
  }
}

TEST_CASE("at most max_peers connect, and another one after a disconnect") {
  const test::TemporaryFolder folder;
  const Parties parties;
  for (const bool with_keys : {false, true}) {
    CAPTURE(with_keys);
    WireContext context;
    ServerAccess access = with_keys ? parties.access(2) : ServerAccess{{}, {}, 2};
    FrameSource source(context, "tcp://127.0.0.1:*", {}, access);
    const ClientAccess client = with_keys ? parties.as(parties.camera) : ClientAccess{};
    FrameSink first(context, source.endpoint(), 16, client);
    CHECK(delivers(first, source, 30s));
    auto second = std::make_unique<FrameSink>(context, source.endpoint(), 16, client);
    CHECK(delivers(*second, source, 30s));
    CHECK(eventually([&] { return source.peers().peers == 2; }));
    FrameSink third(context, source.endpoint(), 16, client);
    CHECK_FALSE(third.send(some_bytes, 300ms));
    CHECK(source.peers().excess >= 1);
    CHECK(delivers(first, source, 30s));
    second.reset();
    CHECK(eventually([&] { return source.peers().peers < 2; }));
    CHECK(delivers(third, source, 30s));
  }
}

TEST_CASE("the sender of too large a message is counted and named by the owner of its key (it was neither)") {
  if (!has_peer_bounds()) return;  // the system's libzmq
  const Parties parties;
  WireContext context;
  WireLimits limits;
  limits.max_points = 10;
  FrameSource source(context, "tcp://127.0.0.1:*", limits, parties.access());
  FrameSink camera(context, source.endpoint(), 16, parties.as(parties.camera));
  REQUIRE(camera.send(std::make_shared<const std::vector<std::byte>>(limits.max_message_bytes() + 1), 30s));
  CHECK(eventually([&] { return source.peers().offending == 1; }));
  const std::vector<PeerVisit> visits = source.visits();
  const auto offense = std::find_if(visits.begin(), visits.end(), [](const PeerVisit& visit) {
    return visit.answer == PeerVisit::Answer::offending;
  });
  REQUIRE(offense != visits.end());
  CHECK(offense->name == "camera");
  CHECK(offense->address == "127.0.0.1");
  CHECK(offense->offense == std::string("a message above the size limit"));
  CHECK(eventually([&] { return camera.send(some_bytes) && source.receive(10ms).has_value(); }));  // connected again
}

TEST_CASE("failed connections of all kinds are counted by cause and leave no state") {
  const Parties parties;
  for (const bool with_keys : {false, true}) {
    CAPTURE(with_keys);
    WireContext context;
    FrameSource source(context, "tcp://127.0.0.1:*", {}, with_keys ? parties.access() : ServerAccess{});
    FrameSink camera(context, source.endpoint(), 16, with_keys ? parties.as(parties.camera) : ClientAccess{});
    CHECK(delivers(camera, source, 30s));
    std::mt19937 random(5);
    for (int i = 0; i < 200; ++i) {
      Knock knock(source.endpoint());
      knock.say(garbage(random));
    }
    const Knock silent(source.endpoint());
    CHECK(eventually([&] { return source.peers().malformed >= 201; }));  // the silent one after two seconds
    CHECK(eventually([&] { return source.peers().connections == 1; }));
    CHECK(source.peers().peers == 1);
    CHECK(source.peers().admitted == 1);
    CHECK_FALSE(source.receive(20ms));
    CHECK(delivers(camera, source, 30s));
  }
}

TEST_CASE("an ipc socket is accessible only to its owner, whatever the umask") {
  const test::TemporaryFolder folder;
  WireContext context;
  const mode_t before = ::umask(0);
  const FrameSource source(context, "ipc://" + (folder / "f").string());
  ::umask(before);
  CHECK(mode_of(folder / "f") == 0600);
}

// Attempts with unknown keys, without keys, with the wrong protocol: 0 frames accepted.
TEST_CASE("attempts without an allowed key: nothing is accepted") {
  const std::uint64_t attempts = std::getenv("LBEA_LONG_TESTS") != nullptr ? 100'000 : 1'000;
  const Parties parties;
  WireContext context;
  FrameSource source(context, "tcp://127.0.0.1:*", {}, parties.access());
  Encoder encoder;
  const auto frame = encoder.frame({1, 1, std::vector<Point>(5)}, 66);
  std::mt19937 random(9);
  for (std::uint64_t done = 0; done < attempts;) {
    std::vector<std::unique_ptr<FrameSink>> strangers;  // each tries again and again while it lives
    const std::uint64_t turned_away = source.peers().unknown + source.peers().malformed;
    for (int i = 0; i < 20; ++i)
      strangers.push_back(std::make_unique<FrameSink>(context, source.endpoint(), 16,
                                                      i % 2 == 0 ? parties.as(generate_key_pair()) : ClientAccess{}));
    for (int i = 0; i < 80; ++i) {
      const Knock knock(source.endpoint());
      knock.say(garbage(random));
    }
    REQUIRE(eventually([&] { return source.peers().unknown + source.peers().malformed >= turned_away + 100; }));
    for (const auto& stranger : strangers) CHECK_FALSE(stranger->send(frame));
    done = source.peers().unknown + source.peers().malformed;
  }
  CHECK_FALSE(source.receive(100ms));
  CHECK(source.peers().admitted == 0);
  const std::uint64_t tried = source.peers().unknown + source.peers().malformed;
  MESSAGE(tried << " attempts, none accepted");
}
