// A peer that writes ZMTP 3 itself, over ipc, and can thereby break it.
#pragma once

#include <doctest/doctest.h>

#include <chrono>
#include <string>
#include <string_view>
#include <thread>

#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

namespace lbea::test {

class RawPeer {
 public:
  static constexpr char more = 1, command = 4;

  explicit RawPeer(const std::string& endpoint) : socket_(::socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0)) {
    sockaddr_un address{};
    address.sun_family = AF_UNIX;
    endpoint.substr(endpoint.find('/') + 2).copy(address.sun_path, sizeof address.sun_path - 1);
    is_connected_ = ::connect(socket_, reinterpret_cast<const sockaddr*>(&address), sizeof address) == 0;
  }
  ~RawPeer() { ::close(socket_); }
  RawPeer(const RawPeer&) = delete;
  RawPeer& operator=(const RawPeer&) = delete;

  [[nodiscard]] bool is_connected() const { return is_connected_; }
  /// Exchanges greetings without keys.
  void greet() {
    std::string greeting = std::string("\xff") + std::string(8, '\0') + "\x7f\x03\x01NULL";
    greeting.resize(64);
    CHECK(send(greeting));
    receive(64);
  }
  /// Ends the handshake as a socket of this type.
  void become(const std::string& type) {
    greet();
    const std::string size{'\0', '\0', '\0', static_cast<char>(type.size())};
    CHECK(send(part("\x05READY\x0bSocket-Type" + size + type, command)));
    const std::string header = receive(2);
    if (header.size() == 2) receive(static_cast<unsigned char>(header[1]));
  }
  /// A frame of ZMTP with less than 256 bytes.
  static std::string part(const std::string& body, char flags = 0) {
    return std::string{flags, static_cast<char>(body.size())} + body;
  }
  /// False once the other side has disconnected.
  bool send(std::string_view bytes) {
    while (!bytes.empty()) {
      const ssize_t sent = ::send(socket_, bytes.data(), bytes.size(), MSG_NOSIGNAL);
      if (sent < 0) return false;
      bytes.remove_prefix(static_cast<std::size_t>(sent));
    }
    return true;
  }
  /// Sends `bytes` again and again. Whether the other side disconnects before `most` bytes are sent.
  bool is_cut_off(const std::string& bytes, std::size_t most, std::chrono::milliseconds pause = {}) {
    for (std::size_t sent = 0; sent < most; sent += bytes.size()) {
      if (!send(bytes)) return true;
      if (pause.count() > 0) std::this_thread::sleep_for(pause);
    }
    return false;
  }

 private:
  std::string receive(std::size_t size) {
    std::string bytes(size, '\0');
    const ssize_t got = ::recv(socket_, bytes.data(), size, MSG_WAITALL);
    bytes.resize(got > 0 ? static_cast<std::size_t>(got) : 0);
    return bytes;
  }

  int socket_;
  bool is_connected_ = false;
};

}  // namespace lbea::test
