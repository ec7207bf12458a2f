// What a matcher reports to a sender about its frames.
#include "tools/shared/intake/handshake.hpp"

#include <doctest/doctest.h>

using namespace lbea;
using namespace lbea::tool;
using namespace lbea::wire;

namespace {

constexpr std::uint64_t left_session = 1, right_session = 2;

Counters counters_of(std::uint64_t queue_full, std::uint64_t out_of_step) {
  Counters counters;
  counters.by_status[static_cast<std::size_t>(WireStatus::queue_full)] = queue_full;
  counters.by_status[static_cast<std::size_t>(WireStatus::out_of_step)] = out_of_step;
  return counters;
}

/// Of a matcher of two rigs, whose numbers increase by `more`.
WireState state_of_rigs(std::uint64_t more) {
  WireState state;
  state.senders = {{left_session, 0, 10 + more, 10 + more, 0, 0, SenderCondition::ended, "left"},
                   {right_session, 0, 10 + more, 10 + more, 0, 0, SenderCondition::ended, "right"}};
  state.rigs = {{"left", "", 0, counters_of(3 + more, 0)}, {"right", "", 0, counters_of(0, 5 + more)}};
  state.counters = counters_of(3 + more, 5 + more);
  return state;
}

Receipt receipt_of(std::initializer_list<std::uint64_t> sessions, const WireState& before, const WireState& after) {
  Receipts receipts(before);
  for (const std::uint64_t session : sessions) receipts.add(session, after);
  return receipts.sum();
}

}  // namespace

// Each lbea-send of several reported what all rigs had lost, and failed.
TEST_CASE("a sender to one of several rigs reports what that rig's senders lost") {
  const WireState before = state_of_rigs(0), after = state_of_rigs(4);
  const Receipt left = receipt_of({left_session}, before, after), right = receipt_of({right_session}, before, after),
                both = receipt_of({left_session, right_session}, before, after);
  CHECK(left.received == 4);
  CHECK(left.dropped == 4);
  CHECK(left.out_of_step == 0);
  CHECK(right.dropped == 0);
  CHECK(right.out_of_step == 4);
  CHECK(both.received == 8);
  CHECK(both.dropped == 4);
  CHECK(both.out_of_step == 4);
}

TEST_CASE("a sender to a matcher of one rig, or that does not name the rigs, reports what all its senders lost") {
  for (const bool is_older : {false, true}) {
    WireState before = state_of_rigs(0), after = state_of_rigs(4);
    for (WireState* state : {&before, &after}) {
      if (!is_older) state->rigs.clear();
      for (WireSender& sender : state->senders) sender.rig.clear();
    }
    CHECK(receipt_of({left_session}, before, after).dropped == 4);
  }
}
