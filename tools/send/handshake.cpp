#include "tools/send/handshake.hpp"

#include "adapters/wire/codec.hpp"

#include <algorithm>

namespace lbea {

namespace {
using Clock = std::chrono::steady_clock;
constexpr std::chrono::milliseconds repeat{100};
}  // namespace

std::optional<WireState> Handshake::greet(const std::function<bool()>& stop) {
  Encoder encoder;
  auto next_hello = Clock::now();
  while (!stop()) {
    if (Clock::now() >= next_hello) {
      frames_.tell(encoder.control({session_, ControlKind::hello, 0, 0}));
      next_hello = Clock::now() + repeat;
    }
    if (own_entry(repeat) != nullptr) return state_;
  }
  return {};
}

std::optional<WireSender> Handshake::receipt(std::uint64_t next_id, std::chrono::milliseconds patience) {
  const auto deadline = Clock::now() + patience;
  while (Clock::now() < deadline) {
    const WireSender* entry = own_entry(repeat);
    if (entry != nullptr && entry->next_id >= next_id) return *entry;
  }
  return {};
}

const WireSender* Handshake::own_entry(std::chrono::milliseconds timeout) {
  const auto message = results_.receive(timeout);
  if (!message || message_kind(*message) != MessageKind::state) return nullptr;
  if (decode_state(*message, state_) != WireStatus::ok) return nullptr;
  const auto own = std::find_if(state_.senders.begin(), state_.senders.end(),
                                [&](const WireSender& sender) { return sender.session == session_; });
  return own == state_.senders.end() ? nullptr : &*own;
}

}  // namespace lbea
