#include "tools/shared/intake/receipt.hpp"

#include <nlohmann/json.hpp>

#include <algorithm>

namespace lbea::tool {
namespace {

constexpr std::chrono::milliseconds longest_wait{5000};

// A matcher that was started anew counts from 0.
std::uint64_t rise(std::uint64_t before, std::uint64_t now) { return now >= before ? now - before : now; }

std::uint64_t dropped(const wire::WireState& state) { return state.counters.of(wire::WireStatus::queue_full); }

}  // namespace

wire::WireSender Receipts::before(std::uint64_t session) const {
  const auto own = std::ranges::find(before_.senders, session, &wire::WireSender::session);
  return own == before_.senders.end() ? wire::WireSender{} : *own;
}

bool Receipts::knew(std::uint64_t session) const { return before(session).received > 0; }

void Receipts::ask(wire::Handshake& handshake, std::uint64_t session, std::uint64_t next_id) {
  const auto now = handshake.part(next_id, 0, longest_wait);
  sum_.is_whole = sum_.is_whole && now;
  if (!now) return;
  const wire::WireSender then = before(session);
  sum_.received += rise(then.received, now->received);
  sum_.missed += rise(then.missed, now->missed);
  sum_.withheld += rise(then.withheld, now->withheld);
  sum_.dropped = rise(dropped(before_), dropped(handshake.state()));
}

std::string receipt_text(const Receipt& receipt) {
  if (!receipt.is_whole) return "; the matcher did not say what arrived";
  return "; the matcher has received " + std::to_string(receipt.received) + ", missed " +
         std::to_string(receipt.missed) +
         (receipt.dropped > 0 ? ", and dropped " + std::to_string(receipt.dropped) + " for want of room in its queue"
                              : "");
}

nlohmann::ordered_json receipt_json(const Receipt& receipt) {
  return {{"received", receipt.received},
          {"withheld", receipt.withheld},
          {"missed", receipt.missed},
          {"dropped", receipt.dropped}};
}

}  // namespace lbea::tool
