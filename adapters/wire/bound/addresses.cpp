#include "adapters/wire/bound/addresses.hpp"

#include <array>

#ifdef _WIN32
#include <ws2tcpip.h>
#else
#include <arpa/inet.h>
#include <netdb.h>
#include <sys/socket.h>
#endif

namespace lbea::wire::detail {
namespace {
#ifdef _WIN32
using Connection = SOCKET;
#else
using Connection = int;
#endif
}  // namespace

bool is_loopback(const std::string& host) noexcept {
  in_addr address{};
  return inet_pton(AF_INET, host.c_str(), &address) == 1 && (ntohl(address.s_addr) >> 24) == 127;
}

bool is_from(std::int32_t descriptor, std::string_view address) noexcept {
  sockaddr_storage peer{};
  socklen_t size = sizeof peer;
  std::array<char, NI_MAXHOST> host{};
  if (::getpeername(static_cast<Connection>(descriptor), reinterpret_cast<sockaddr*>(&peer), &size) != 0) return false;
  if (peer.ss_family == AF_UNIX) return address.starts_with("localhost:");
  const int error = ::getnameinfo(reinterpret_cast<const sockaddr*>(&peer), size, host.data(), host.size(), nullptr, 0,
                                  NI_NUMERICHOST);
  return error == 0 && address == host.data();
}
}  // namespace lbea::wire::detail
