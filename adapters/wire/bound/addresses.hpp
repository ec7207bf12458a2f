// Addresses of the internet's hosts. Only the .cpp files of this library include it.
#pragma once

#include <cerrno>
#include <cstdint>
#include <string>
#include <string_view>

#ifdef _WIN32
#include <winsock2.h>
#endif

namespace lbea::wire::detail {
#ifdef _WIN32
inline constexpr int too_many_subscriptions = WSAEDQUOT;  // see third_party/zmq/3-peer-bounds.patch
#else
inline constexpr int too_many_subscriptions = EDQUOT;  // see third_party/zmq/3-peer-bounds.patch
#endif

/// Whether a host is an address 127.x.y.z.
[[nodiscard]] bool is_loopback(const std::string& host) noexcept;
/// Whether a connection's peer has this address, as ZeroMQ gives it (see PeerVisit).
[[nodiscard]] bool is_from(std::int32_t descriptor, std::string_view address) noexcept;
}  // namespace lbea::wire::detail
