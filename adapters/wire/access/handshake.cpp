#include "adapters/wire/access/handshake.hpp"

#include "adapters/wire/codec/codec.hpp"

#include <algorithm>

namespace lbea::wire {
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

// What is on its way when a connection breaks is lost with it, a goodbye too: it is repeated, which changes nothing.
std::optional<WireSender> Handshake::part(std::uint64_t next_id, std::uint64_t withheld,
                                          std::chrono::milliseconds patience) {
  Encoder encoder;
  const auto deadline = Clock::now() + patience;
  for (auto next_goodbye = Clock::now(); Clock::now() < deadline;) {
    if (Clock::now() >= next_goodbye) {
      frames_.tell(encoder.control({session_, ControlKind::goodbye, next_id, withheld}));
      next_goodbye = Clock::now() + repeat;
    }
    const WireSender* entry = own_entry(repeat);
    if (entry != nullptr && entry->next_id >= next_id && entry->condition == SenderCondition::ended) return *entry;
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

}  // namespace lbea::wire
