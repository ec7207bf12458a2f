// What ZeroMQ says of a socket's connections.
#pragma once

#include <zmq.hpp>

#include <cstdint>

namespace lbea::wire::detail {

struct SocketEvent {
  std::uint16_t kind = 0;  // ZMQ_EVENT_...
  std::int32_t value = 0;  // a file descriptor, an error number, ...: what the kind says
};

enum class EventRead { done, none, closed };
/// Of a PAIR socket connected to a monitor; does not wait.
[[nodiscard]] EventRead read_event(zmq::socket_t& monitor, SocketEvent& event) noexcept;

}  // namespace lbea::wire::detail
