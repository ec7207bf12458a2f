#include "tools/shared/intake/id_tracker.hpp"

#include <doctest/doctest.h>

#include <algorithm>
#include <limits>
#include <random>
#include <set>

using namespace lbea;
using namespace lbea::tool;
using namespace lbea::wire;

TEST_CASE("gaps and duplicates within a session") {
  IdTracker ids;
  for (const std::uint64_t id : {10u, 11u, 14u, 14u, 12u, 15u}) ids.observe(1, id);
  CHECK(ids.missed() == 1);      // 12 and 13 when 14 came, 12 came after all
  CHECK(ids.duplicates() == 1);  // 14 again
  CHECK(ids.reordered() == 1);
  CHECK(ids.sessions() == 1);
}

TEST_CASE("a late id is removed from its gap once, wherever it lies in the gap") {
  for (const std::uint64_t late : {1u, 5u, 9u}) {
    CAPTURE(late);
    IdTracker ids;
    CHECK(ids.observe(7, 0).gap == IdRange{});
    CHECK(ids.observe(7, 10).gap == IdRange{1, 9});
    CHECK(ids.observe(7, late).arrival == IdTracker::Arrival::late);
    CHECK(ids.observe(7, late).arrival == IdTracker::Arrival::duplicate);
    CHECK(ids.missed() == 8);
    for (std::uint64_t id = 1; id < 10; ++id)
      if (id != late) CHECK(ids.observe(7, id).arrival == IdTracker::Arrival::late);
    CHECK(ids.missed() == 0);
    CHECK(ids.observe(7, 11).gap == IdRange{});
  }
}

// Regression: late frames split gaps without a limit, and each took longer than the one before.
TEST_CASE("the latest 64 gaps are remembered, also of a gap that late frames split") {
  IdTracker ids;
  ids.observe(7, 0);
  ids.observe(7, 1001);
  for (std::uint64_t id = 2; id < 1000; id += 2) CHECK(ids.observe(7, id).arrival == IdTracker::Arrival::late);
  std::size_t remembered = 0;
  for (std::uint64_t id = 1; id < 1000; id += 2)
    remembered += ids.observe(7, id).arrival == IdTracker::Arrival::late ? 1u : 0u;
  CHECK(remembered <= 64);
  CHECK(remembered >= 63);
  CHECK(ids.observe(7, 1).arrival == IdTracker::Arrival::duplicate);
}

// In any order, with duplicates and control messages, each id is exactly one of received, missed, withheld.
TEST_CASE("the account of a session agrees with the set of its ids") {
  std::mt19937 random(3);
  for (int round = 0; round < 300; ++round) {
    IdTracker ids;
    static_cast<void>(ids.report({1, ControlKind::hello, 0, 0}));
    std::set<std::uint64_t> received, withheld;
    std::uint64_t next = 0, duplicates = 0, gaps = 0;
    for (int step = 0; step < 60; ++step) {
      if (random() % 4 == 0) {
        const std::uint64_t told_next = next + random() % 4;
        const std::uint64_t held = random() % (told_next - next + 1);
        const auto report = ids.report({1, ControlKind::heartbeat, told_next, held});
        CHECK(report.withheld.count == held);
        gaps += report.gap.count;
        for (std::uint64_t id = told_next - held; id < told_next; ++id) withheld.insert(id);
        next = told_next;
      } else {
        const std::uint64_t id = random() % (next + 3);
        const auto seen = ids.observe(1, id);
        gaps += seen.gap.count;
        const bool is_second = received.contains(id) || withheld.contains(id);
        CHECK((seen.arrival == IdTracker::Arrival::duplicate) == is_second);
        CHECK((seen.arrival == IdTracker::Arrival::late) == (!is_second && id < next));
        duplicates += is_second ? 1 : 0;
        if (!is_second) received.insert(id);
        next = std::max(next, id + 1);
      }
      const WireSender sender = ids.senders({}, {}).front();
      REQUIRE(sender.next_id == next);
      REQUIRE(sender.received == received.size());
      REQUIRE(sender.withheld == withheld.size());
      REQUIRE(sender.missed == next - received.size() - withheld.size());
      REQUIRE(ids.missed() == sender.missed);
      REQUIRE(ids.missed() + ids.reordered() == gaps);
      REQUIRE(ids.duplicates() == duplicates);
    }
  }
}

TEST_CASE("a sender reports the missing end of a stream, and withheld ids") {
  IdTracker ids;
  static_cast<void>(ids.report({9, ControlKind::hello, 0, 0}));
  CHECK(ids.observe(9, 2).gap == IdRange{0, 2});  // from the hello on every id counts
  const auto report = ids.report({9, ControlKind::heartbeat, 10, 3});
  CHECK(report.gap == IdRange{3, 4});
  CHECK(report.withheld == IdRange{7, 3});
  CHECK(ids.report({9, ControlKind::heartbeat, 10, 3}).withheld.count == 0);
  CHECK(ids.report({9, ControlKind::heartbeat, 5, 5}).gap == IdRange{});  // already known
  CHECK(ids.observe(9, 8).arrival == IdTracker::Arrival::duplicate);
  CHECK(ids.report({9, ControlKind::goodbye, 12, 0}).gap == IdRange{10, 2});
  CHECK(ids.missed() == 8);
  CHECK(ids.withheld() == 3);
  CHECK(ids.senders({}, {}).front().condition == SenderCondition::ended);
  // A receiver that starts later learns only of new ids.
  IdTracker late;
  CHECK(late.report({9, ControlKind::heartbeat, 100, 4}).gap == IdRange{});
  CHECK(late.withheld() == 4);
}

TEST_CASE("silent are only senders of control messages without goodbye") {
  using namespace std::chrono_literals;
  const IdTracker::Clock::time_point begin{1h};
  IdTracker ids;
  ids.observe(1, 0, begin);
  static_cast<void>(ids.report({2, ControlKind::hello, 0, 0}, begin));
  static_cast<void>(ids.report({3, ControlKind::hello, 0, 0}, begin));
  static_cast<void>(ids.report({3, ControlKind::goodbye, 0, 0}, begin));
  const auto conditions = [&](IdTracker::Clock::time_point now) {
    std::vector<SenderCondition> found;
    for (const auto& sender : ids.senders(now, 3s)) found.push_back(sender.condition);
    return found;
  };
  using enum SenderCondition;
  CHECK(conditions(begin + 3s) == std::vector{active, active, ended});
  CHECK(conditions(begin + 4s) == std::vector{active, silent, ended});
  ids.observe(2, 0, begin + 5s);
  CHECK(conditions(begin + 6s) == std::vector{active, active, ended});
}

// Regression: a stray program's damaged frame owned the test until it timed out.
TEST_CASE("with one sender only frames that can be matched own the test") {
  using namespace std::chrono_literals;
  const IdTracker::Clock::time_point now{1h};
  IdTracker ids;
  ids.allow_one_sender(3s);
  ids.observe(9, 0, now);  // rejected for its contents
  ids.observe(1, 0, now);
  CHECK(ids.enter_test(1, now));
  ids.observe(9, 1, now);
  CHECK_FALSE(ids.enter_test(9, now));
  static_cast<void>(ids.report({1, ControlKind::goodbye, 1, 0}, now));
  CHECK(ids.observe(1, 0, now).arrival == IdTracker::Arrival::duplicate);
  ids.observe(9, 2, now);
  CHECK(ids.enter_test(9, now));
  CHECK(ids.interleaved() == 0);
  ids.observe(1, 1, now);
  CHECK_FALSE(ids.enter_test(1, now));
}

TEST_CASE("sessions are independent") {
  IdTracker ids;
  for (std::uint64_t id = 0; id < 100; ++id) {
    ids.observe(1, id);
    ids.observe(2, 1000 + id);
  }
  CHECK(ids.missed() == 0);
  CHECK(ids.duplicates() == 0);
  CHECK(ids.sessions() == 2);
}

TEST_CASE("extreme ids are handled") {
  constexpr auto last = std::numeric_limits<std::uint64_t>::max() - 1;
  constexpr auto far = std::uint64_t{1} << 32;
  using enum IdTracker::Arrival;
  IdTracker ids;
  CHECK(ids.observe(3, last + 1).arrival == impossible);  // has no successor
  CHECK(ids.sessions() == 0);
  CHECK(ids.observe(2, last).arrival == in_order);
  CHECK(ids.observe(2, last).arrival == duplicate);
  CHECK(ids.observe(2, last + 1).arrival == impossible);
  CHECK(ids.duplicates() == 1);
  CHECK(ids.senders({}, {}).front().next_id == last + 1);
  // Regression: one wrong number made the account "captured 1, matched 4, dropped 18446744073709551611".
  ids.observe(1, 0);
  for (const std::uint64_t id : {last, far + 1}) CHECK(ids.observe(1, id).arrival == impossible);
  CHECK_FALSE(ids.report({1, ControlKind::goodbye, last, 0}).is_possible);
  CHECK_FALSE(ids.report({1, ControlKind::goodbye, last, last}).is_possible);
  CHECK_FALSE(ids.report({4, ControlKind::goodbye, last, far}).is_possible);
  CHECK(ids.missed() == 0);
  CHECK(ids.withheld() == 0);
  CHECK(ids.observe(1, far).arrival == in_order);
  CHECK(ids.missed() == far - 1);
  CHECK(ids.report({1, ControlKind::goodbye, far + 1, 0}).is_possible);
}

// Regression: of 100 frames in any order from a sender without control messages, half were rejected as duplicates.
TEST_CASE("frames that arrive after a session's first one with lower ids are not duplicates") {
  std::mt19937 random(9);
  for (const std::uint64_t first : {0u, 5u, 2000u}) {
    std::vector<std::uint64_t> order(100);
    for (std::uint64_t i = 0; i < order.size(); ++i) order[i] = first + i;
    std::ranges::shuffle(order, random);
    IdTracker ids;
    for (const std::uint64_t id : order) CHECK(ids.observe(1, id).arrival != IdTracker::Arrival::duplicate);
    for (const std::uint64_t id : order) CHECK(ids.observe(1, id).arrival == IdTracker::Arrival::duplicate);
    CHECK(ids.missed() == 0);
    CHECK(ids.senders({}, {}).front().received == 100);
    CHECK(ids.senders({}, {}).front().first_id == first);
  }
  IdTracker ids;
  ids.observe(1, 5000);
  CHECK(ids.observe(1, 4990).gap == IdRange{4991, 9});  // these are missed as of now
  CHECK(ids.missed() == 9);
  CHECK(ids.observe(1, 5000 - 1024).gap == IdRange{5000 - 1023, 1013});
  CHECK(ids.senders({}, {}).front().received == 3);
  CHECK(ids.observe(1, 5000 - 1025).arrival == IdTracker::Arrival::duplicate);  // further back nothing is remembered
  // After a hello the session has no ids before its begin.
  static_cast<void>(ids.report({2, ControlKind::hello, 10, 0}));
  CHECK(ids.observe(2, 9).arrival == IdTracker::Arrival::duplicate);
}

// Regression: 64 made-up hellos gave the running test to another sender, and received frames were missed.
TEST_CASE("a crowd of sessions without frames does not displace those with frames") {
  IdTracker ids;
  ids.allow_one_sender(std::chrono::hours(1));
  for (std::uint64_t id = 0; id < 10; ++id) ids.observe(1, id);
  CHECK(ids.enter_test(1));
  for (std::uint64_t session = 100; session < 300; ++session)
    static_cast<void>(ids.report({session, ControlKind::hello, 0, 0}));
  ids.observe(2, 0);
  CHECK_FALSE(ids.enter_test(2));
  CHECK(ids.observe(1, 5).arrival == IdTracker::Arrival::duplicate);
  CHECK(ids.missed() == 0);
}

TEST_CASE("with many sessions the least recently used one is forgotten; memory is bounded") {
  IdTracker ids;
  for (std::uint64_t session = 0; session < 10'000; ++session) {
    ids.observe(session, 5);
    ids.observe(12'345, session);  // never the least recent
  }
  CHECK(ids.sessions() == 10'001);
  CHECK(ids.missed() == 0);
  CHECK(ids.duplicates() == 0);
  ids.observe(0, 5);  // forgotten: a new session
  CHECK(ids.sessions() == 10'002);
}
