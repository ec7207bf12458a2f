#include "adapters/wire/bound/bound_endpoint.hpp"
#include "adapters/wire/sockets/streams.hpp"
#include "tests/support/test_data.hpp"
#include "tests/wire/wire_support.hpp"

#include <doctest/doctest.h>

#include <fstream>

using namespace lbea;
using namespace lbea::wire;
using lbea::test::error_of;
using lbea::test::mentions;

TEST_CASE("valid endpoints") {
  for (const char* address : {"ipc:///tmp/a", "ipc://relative", "tcp://127.0.0.1:5555", "tcp://rig.local:1",
                              "tcp://10.0.0.1:65535", "inproc://frames"}) {
    CAPTURE(address);
    CHECK(parse_endpoint(address).address == address);
  }
  CHECK(parse_endpoint("ipc:///tmp/a").path == "/tmp/a");
}

TEST_CASE("invalid endpoints are rejected with a sentence") {
  for (const std::string address :
       {"", "frames", "udp://127.0.0.1:1", "tcp://", "tcp://127.0.0.1", "tcp://:5555",
        "tcp://127.0.0.1:", "tcp://127.0.0.1:0", "tcp://127.0.0.1:65536", "tcp://127.0.0.1:12a", "tcp://127.0.0.1:-1",
        "ipc://", "ipc://@name", "ipc://*", "inproc://"}) {
    CAPTURE(address);
    const Error error = error_of([&] { static_cast<void>(parse_endpoint(address)); });
    CHECK(error.status == Status::bad_config);
    CHECK(mentions(error, "\"" + address + "\""));
  }
  const Error error = error_of([&] { static_cast<void>(parse_endpoint("ipc:///" + std::string(200, 'a'))); });
  CHECK(error.status == Status::bad_config);
  CHECK(mentions(error, "107 bytes"));
}

TEST_CASE("only this machine may connect") {
  CHECK(parse_bind_endpoint("tcp://127.0.0.1:5555").address == "tcp://127.0.0.1:5555");
  CHECK(parse_bind_endpoint("tcp://127.3.2.1:*").address == "tcp://127.3.2.1:*");
  CHECK(parse_bind_endpoint("tcp://localhost:5555").address == "tcp://127.0.0.1:5555");
  for (const std::string address : {"tcp://*:5555", "tcp://0.0.0.0:5555", "tcp://10.0.0.1:5555", "tcp://128.0.0.1:1",
                                    "tcp://127.0.0.1.evil.com:5555", "tcp://eth0:5555"}) {
    CAPTURE(address);
    const Error error = error_of([&] { static_cast<void>(parse_bind_endpoint(address)); });
    CHECK(error.status == Status::bad_config);
    CHECK(mentions(error, "use 127.0.0.1 instead of"));
  }
}

TEST_CASE("a lock has one holder and leaves no file") {
  const test::TemporaryFolder folder;
  const Endpoint endpoint = parse_endpoint("ipc://" + (folder / "frames").string());
  for (int round = 0; round < 3; ++round) {
    EndpointLock lock(endpoint);
    CHECK(std::filesystem::exists(folder / "frames.lock"));
    const Error error = error_of([&] { EndpointLock second(endpoint); });
    CHECK(error.status == Status::endpoint_unavailable);
    CHECK(mentions(error, "in use by another process"));
    EndpointLock moved = std::move(lock);
    CHECK(error_of([&] { EndpointLock second(endpoint); }).status == Status::endpoint_unavailable);
  }
  CHECK_FALSE(std::filesystem::exists(folder / "frames.lock"));
}

TEST_CASE("the lock file of a killed process is reused") {
  const test::TemporaryFolder folder;
  const Endpoint endpoint = parse_endpoint("ipc://" + (folder / "frames").string());
  const pid_t child = ::fork();
  if (child == 0) {
    static const EndpointLock lock(endpoint);
    ::raise(SIGKILL);
  }
  int status = 0;
  ::waitpid(child, &status, 0);
  REQUIRE(std::filesystem::exists(folder / "frames.lock"));
  CHECK(error_of([&] { EndpointLock lock(endpoint); }).status == Status::ok);
}

// Regression: a clean-up of old files removed a lock file, and a second matcher took over the running one's socket.
TEST_CASE("a listening endpoint is not taken over when its lock file was removed") {
  const test::TemporaryFolder folder;
  WireContext context;
  FrameSource first(context, "ipc://" + (folder / "frames").string());
  std::filesystem::remove(folder / "frames.lock");
  const Error error = error_of([&] { FrameSource second(context, "ipc://" + (folder / "frames").string()); });
  CHECK(error.status == Status::endpoint_unavailable);
  CHECK(mentions(error, "lock file somebody removed"));
  FrameSink sink(context, first.endpoint());
  REQUIRE(sink.send(std::vector<std::byte>(3), std::chrono::seconds(30)));
  CHECK(first.receive(std::chrono::seconds(30)));
}

// Regression: the end of a matcher whose files somebody had removed removed those of the next one.
TEST_CASE("a process leaves the socket and the lock of the one that came after its own were removed") {
  const test::TemporaryFolder folder;
  const std::string address = "ipc://" + (folder / "frames").string();
  WireContext context;
  std::optional<FrameSource> first(std::in_place, context, address);
  std::filesystem::remove(folder / "frames.lock");
  std::filesystem::remove(folder / "frames");
  FrameSource second(context, address);
  first.reset();
  CHECK(std::filesystem::exists(folder / "frames"));
  CHECK(std::filesystem::exists(folder / "frames.lock"));
  FrameSink sink(context, address);
  REQUIRE(sink.send(std::vector<std::byte>(3), std::chrono::seconds(30)));
  CHECK(second.receive(std::chrono::seconds(30)));
}

TEST_CASE("a folder that does not exist") {
  const Error error = error_of([] { EndpointLock lock(parse_endpoint("ipc:///no/such/folder/frames")); });
  CHECK(error.status == Status::endpoint_unavailable);
  CHECK(mentions(error, "/no/such/folder/frames.lock"));
}

// Regression: a regular file at the ipc path, for example a model, was deleted.
TEST_CASE("a regular file at an ipc path is kept, and no lock file remains") {
  const test::TemporaryFolder folder;
  std::ofstream(folder / "rail.lbea") << "precious";
  const Endpoint endpoint = parse_bind_endpoint("ipc://" + (folder / "rail.lbea").string());
  CHECK_THROWS_WITH_AS(EndpointLock{endpoint}, doctest::Contains("is not a socket"), Error);
  CHECK(std::filesystem::file_size(folder / "rail.lbea") == 8);
  CHECK_FALSE(std::filesystem::exists(folder / "rail.lbea.lock"));
}
