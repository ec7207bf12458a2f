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

std::optional<wire::WireSender> entry_of(const wire::WireState& state, std::uint64_t session) {
  const auto own = std::ranges::find(state.senders, session, &wire::WireSender::session);
  return own == state.senders.end() ? std::nullopt : std::optional(*own);
}

/// By the matcher, of all its senders or, if it names their rigs, of those of these rigs.
std::uint64_t refused(const wire::WireState& state, const std::set<std::string>& rigs,
                      std::initializer_list<wire::WireStatus> statuses) {
  const auto of = [&](const wire::Counters& counters) {
    std::uint64_t frames = 0;
    for (const wire::WireStatus status : statuses) frames += counters.of(status);
    return frames;
  };
  if (state.rigs.empty() || rigs.contains("")) return of(state.counters);
  std::uint64_t frames = 0;
  for (const wire::WireRig& rig : state.rigs)
    if (rigs.contains(rig.name)) frames += of(rig.counters);
  return frames;
}

}  // namespace

std::optional<wire::WireState> wait_for_state(wire::ResultSource& results, const std::function<bool()>& stop) {
  wire::WireState state;
  while (!stop()) {
    const auto message = results.receive(repeat_interval);
    if (message && wire::message_kind(*message) == wire::MessageKind::state &&
        wire::decode_state(*message, state) == wire::WireStatus::ok)
      return state;
  }
  return {};
}

std::optional<wire::WireState> Handshake::begin(const std::function<bool()>& stop) {
  const auto is_known = [](const wire::WireSender&) { return true; };
  return tell_until(is_known, {session_, wire::ControlKind::hello, 0, 0}, stop) ? std::optional(state_) : std::nullopt;
}

// A breaking connection loses the messages in transit, possibly the goodbye too. Repeating it changes nothing.
std::optional<wire::WireSender> Handshake::end(std::uint64_t next_id, std::uint64_t withheld,
                                               std::chrono::milliseconds timeout) {
  const auto is_complete = [next_id](const wire::WireSender& entry) {
    return entry.next_id >= next_id && entry.condition == wire::SenderCondition::ended;
  };
  return tell_until(is_complete, {session_, wire::ControlKind::goodbye, next_id, withheld},
                    [deadline = Clock::now() + timeout] { return Clock::now() >= deadline; });
}

std::optional<wire::WireSender> Handshake::tell_until(const std::function<bool(const wire::WireSender&)>& is_enough,
                                                      const wire::Control& control, const std::function<bool()>& stop) {
  wire::Encoder encoder;
  for (auto next = Clock::now(); !stop();) {
    if (Clock::now() >= next) {
      frames_.tell(encoder.control(control));
      next = Clock::now() + repeat_interval;
    }
    const auto message = results_.receive(repeat_interval);
    if (!message || wire::message_kind(*message) != wire::MessageKind::state) continue;
    if (wire::decode_state(*message, state_) != wire::WireStatus::ok) continue;
    const auto entry = entry_of(state_, session_);
    if (entry && is_enough(*entry)) return entry;
  }
  return {};
}

bool Receipts::knew(std::uint64_t session) const {
  return entry_of(before_, session).value_or(wire::WireSender{}).received > 0;
}

void Receipts::collect(Handshake& handshake, std::uint64_t session, std::uint64_t next_id) {
  if (handshake.end(next_id, 0, receipt_timeout))
    add(session, handshake.state());
  else
    sum_.is_whole = false;
}

void Receipts::add(std::uint64_t session, const wire::WireState& state) {
  const auto now = entry_of(state, session);
  if (!now) return;
  const wire::WireSender then = entry_of(before_, session).value_or(wire::WireSender{});
  sum_.received += increase(then.received, now->received);
  sum_.missed += increase(then.missed, now->missed);
  sum_.withheld += increase(then.withheld, now->withheld);
  rigs_.insert(now->rig);
  const auto increase_of = [&](std::initializer_list<wire::WireStatus> statuses) {
    return increase(refused(before_, rigs_, statuses), refused(state, rigs_, statuses));
  };
  sum_.out_of_step = increase_of({wire::WireStatus::out_of_step});
  sum_.dropped = increase_of({wire::WireStatus::queue_full, wire::WireStatus::other_sender});
}

std::string receipt_text(const Receipt& receipt) {
  if (!receipt.is_whole) return "; the matcher did not report what arrived";
  return "; the matcher has received " + std::to_string(receipt.received) + ", missed " +
         std::to_string(receipt.missed) +
         (receipt.dropped > 0 ? ", and dropped " + std::to_string(receipt.dropped) +
                                    ": its queue was full, or another sender's test was running"
                              : "") +
         (receipt.out_of_step > 0 ? ", and refused " + std::to_string(receipt.out_of_step) +
                                        " as out_of_step: start it with a longer --wait-us"
                                  : "");
}

nlohmann::ordered_json receipt_json(const Receipt& receipt) {
  nlohmann::ordered_json json{{"received", receipt.received},
                              {"withheld", receipt.withheld},
                              {"missed", receipt.missed},
                              {"dropped", receipt.dropped}};
  if (receipt.out_of_step > 0) json["out_of_step"] = receipt.out_of_step;
  return json;
}

}  // namespace lbea::tool
