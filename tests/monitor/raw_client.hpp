// A client that sends exactly the bytes of the test.
#pragma once

#include <doctest/doctest.h>

#include <cstdint>
#include <cstring>
#include <string>
#include <utility>

#include <arpa/inet.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <sys/time.h>
#include <unistd.h>

namespace lbea::test {

class RawClient {
 public:
  explicit RawClient(std::uint16_t port, int receive_buffer = 0)
      : port_(port), socket_(::socket(AF_INET, SOCK_STREAM, 0)) {
    if (receive_buffer > 0) ::setsockopt(socket_, SOL_SOCKET, SO_RCVBUF, &receive_buffer, sizeof receive_buffer);
    const timeval timeout{20, 0};
    ::setsockopt(socket_, SOL_SOCKET, SO_RCVTIMEO, &timeout, sizeof timeout);
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_port = htons(port);
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    REQUIRE(::connect(socket_, reinterpret_cast<const sockaddr*>(&address), sizeof address) == 0);
  }
  ~RawClient() { ::close(socket_); }
  RawClient(const RawClient&) = delete;
  RawClient& operator=(const RawClient&) = delete;

  void send(const std::string& text) const {
    static_cast<void>(::send(socket_, text.data(), text.size(), MSG_NOSIGNAL));
  }
  /// Receives at least `least` bytes, or all until the connection is closed.
  [[nodiscard]] std::string receive(std::size_t least) {
    std::string received = std::exchange(ahead_, {});
    char buffer[65536];
    while (received.size() < least) {
      const ssize_t got = ::recv(socket_, buffer, sizeof buffer, 0);
      if (got <= 0) break;
      received.append(buffer, static_cast<std::size_t>(got));
    }
    return received;
  }
  [[nodiscard]] std::string host() const { return "127.0.0.1:" + std::to_string(port_); }
  /// The whole response to a request; then the connection is closed.
  [[nodiscard]] std::string ask(const std::string& line, const std::string& headers = "", std::string host = "") {
    if (host.empty()) host = this->host();
    send(line + " HTTP/1.1\r\nHost: " + host + "\r\n" + headers + "Connection: close\r\n\r\n");
    return receive(SIZE_MAX);
  }
  /// Requests a WebSocket and returns the head of the response.
  [[nodiscard]] std::string upgrade(const std::string& headers = "", std::string host = "") {
    if (host.empty()) host = this->host();
    send("GET /live HTTP/1.1\r\nHost: " + host +
         "\r\nUpgrade: websocket\r\nConnection: Upgrade\r\nSec-WebSocket-Version: 13\r\n"
         "Sec-WebSocket-Key: AAAAAAAAAAAAAAAAAAAAAA==\r\n" +
         headers + "\r\n");
    std::string received;
    while (received.find("\r\n\r\n") == std::string::npos) {
      const std::string more = receive(1);
      if (more.empty()) break;
      received += more;
    }
    const std::size_t end = std::min(received.find("\r\n\r\n"), received.size());
    if (end + 4 <= received.size()) ahead_ = received.substr(end + 4);
    return received.substr(0, end);
  }
  /// The payload of the next WebSocket message, which must be one frame; empty when the connection is closed.
  [[nodiscard]] std::string next_message() {
    std::string bytes = receive(2);
    if (bytes.size() < 2) return {};
    std::size_t head = 2, length = static_cast<unsigned char>(bytes[1]) & 127u;
    const std::size_t wide = length == 126 ? 2 : length == 127 ? 8 : 0;
    if (wide > 0) {
      bytes += receive_more(bytes, head + wide);
      length = 0;
      for (std::size_t i = 0; i < wide; ++i) length = length * 256 + static_cast<unsigned char>(bytes[head + i]);
      head += wide;
    }
    bytes += receive_more(bytes, head + length);
    if (bytes.size() < head + length) return {};
    ahead_ = bytes.substr(head + length);
    return bytes.substr(head, length);
  }

 private:
  std::string receive_more(const std::string& have, std::size_t wanted) {
    return have.size() >= wanted ? "" : receive(wanted - have.size());
  }
  std::uint16_t port_;
  int socket_;
  std::string ahead_;
};

}  // namespace lbea::test
