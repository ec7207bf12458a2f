#include "tools/shared/intake/handshake.hpp"

#include "adapters/wire/codec/codec.hpp"

#include <nlohmann/json.hpp>

#include <algorithm>

namespace lbea::tool {
namespace {

using Clock = std::chrono::steady_clock;
constexpr std::chrono::milliseconds repeat_interval{100};
constexpr std::chrono::milliseconds receipt_timeout{5000};

// A restarted matcher counts from 0.
std::uint64_t increase(std::uint64_t before, std::uint64_t now) { return now >= before ? now - before : now; }

std::uint64_t dropped(const wire::WireState& state) { return state.counters.of(wire::WireStatus::queue_full); }

}  // namespace

std::optional<wire::WireState> Handshake::begin(const std::function<bool()>& stop) {
  wire::Encoder encoder;
  auto next_hello = Clock::now();
  while (!stop()) {
    if (Clock::now() >= next_hello) {
      frames_.tell(encoder.control({session_, wire::ControlKind::hello, 0, 0}));
      next_hello = Clock::now() + repeat_interval;
    }
    if (own_entry(repeat_interval) != nullptr) return state_;
  }
  return {};
}

// A breaking connection loses the messages in transit, possibly the goodbye too. Repeating it changes nothing.
std::optional<wire::WireSender> Handshake::end(std::uint64_t next_id, std::uint64_t withheld,
                                               std::chrono::milliseconds timeout) {
  wire::Encoder encoder;
  const auto deadline = Clock::now() + timeout;
  for (auto next_goodbye = Clock::now(); Clock::now() < deadline;) {
    if (Clock::now() >= next_goodbye) {
      frames_.tell(encoder.control({session_, wire::ControlKind::goodbye, next_id, withheld}));
      next_goodbye = Clock::now() + repeat_interval;
    }
    const wire::WireSender* entry = own_entry(repeat_interval);
    if (entry != nullptr && entry->next_id >= next_id && entry->condition == wire::SenderCondition::ended)
      return *entry;
  }
  return {};
}

const wire::WireSender* Handshake::own_entry(std::chrono::milliseconds timeout) {
  const auto message = results_.receive(timeout);
  if (!message || wire::message_kind(*message) != wire::MessageKind::state) return nullptr;
  if (wire::decode_state(*message, state_) != wire::WireStatus::ok) return nullptr;
  const auto own = std::ranges::find(state_.senders, session_, &wire::WireSender::session);
  return own == state_.senders.end() ? nullptr : &*own;
}

wire::WireSender Receipts::before(std::uint64_t session) const {
  const auto own = std::ranges::find(before_.senders, session, &wire::WireSender::session);
  return own == before_.senders.end() ? wire::WireSender{} : *own;
}

void Receipts::collect(Handshake& handshake, std::uint64_t session, std::uint64_t next_id) {
  const auto now = handshake.end(next_id, 0, receipt_timeout);
  sum_.is_whole = sum_.is_whole && now;
  if (!now) return;
  const wire::WireSender then = before(session);
  sum_.received += increase(then.received, now->received);
  sum_.missed += increase(then.missed, now->missed);
  sum_.withheld += increase(then.withheld, now->withheld);
  sum_.dropped = increase(dropped(before_), dropped(handshake.state()));
}

std::string receipt_text(const Receipt& receipt) {
  if (!receipt.is_whole) return "; the matcher did not report what arrived";
  return "; the matcher has received " + std::to_string(receipt.received) + ", missed " +
         std::to_string(receipt.missed) +
         (receipt.dropped > 0 ? ", and dropped " + std::to_string(receipt.dropped) + " because its queue was full"
                              : "");
}

nlohmann::ordered_json receipt_json(const Receipt& receipt) {
  return {{"received", receipt.received},
          {"withheld", receipt.withheld},
          {"missed", receipt.missed},
          {"dropped", receipt.dropped}};
}

}  // namespace lbea::tool
