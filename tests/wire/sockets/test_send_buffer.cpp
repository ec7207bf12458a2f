// The kernel's send buffers of this process's connections.
#include "adapters/wire/sockets/socket_monitor.hpp"
#include "adapters/wire/sockets/streams.hpp"
#include "tests/wire/wire_support.hpp"

#include <doctest/doctest.h>

#include <sys/socket.h>
#include <sys/un.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

using namespace lbea;
using namespace lbea::wire;
using namespace std::chrono_literals;
using lbea::test::eventually;

namespace {

/// SO_SNDBUF of every socket of this process that is connected to `path`.
std::vector<int> send_buffers(const std::string& path) {
  std::vector<int> buffers;
  for (const auto& entry : std::filesystem::directory_iterator("/proc/self/fd")) {
    const int file = std::stoi(entry.path().filename());
    sockaddr_un peer{};
    socklen_t size = sizeof(peer);
    if (getpeername(file, reinterpret_cast<sockaddr*>(&peer), &size) != 0 || peer.sun_family != AF_UNIX ||
        path != peer.sun_path)
      continue;
    int bytes = 0;
    socklen_t length = sizeof(bytes);
    getsockopt(file, SOL_SOCKET, SO_SNDBUF, &bytes, &length);
    buffers.push_back(bytes);
  }
  return buffers;
}

/// The system doubles the requested size, up to a limit, for its own book-keeping (socket(7)).
int granted() {
  int limit = 0;
  std::ifstream("/proc/sys/net/core/wmem_max") >> limit;
  return 2 * std::min(detail::ConnectionWatch::wanted_bytes, limit);
}

}  // namespace

TEST_CASE(
    "an ipc connection gets the largest send buffer that the system grants, also after a restart of the receiver") {
  const test::TemporaryFolder folder;
  const std::string path = (folder / "frames").string();
  WireContext context;
  FrameSink sink(context, "ipc://" + path);
  const std::vector<std::byte> message(100);
  for (int start = 0; start < 3; ++start) {
    FrameSource source(context, "ipc://" + path);
    REQUIRE(eventually([&] { return sink.send(message, 10ms) && source.receive(10ms); }));
    REQUIRE(eventually([&] { return sink.send(message, 10ms) && send_buffers(path) == std::vector{granted()}; }));
  }
}
