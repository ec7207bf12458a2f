// Which frames of several rigs a capture consists of, and which of their senders' frames a test.
#include "tools/serve/pipeline/capture_matcher.hpp"

#include <doctest/doctest.h>

#include <functional>
#include <map>

using namespace lbea;
using namespace lbea::tool;
using namespace std::chrono_literals;

namespace {

constexpr std::int64_t us = 1000, ms = 1'000'000;

/// Frames of two rigs; stamps and arrivals in us.
class Grouped {
 public:
  bool add(std::uint32_t rig, std::int64_t stamp, std::int64_t arrival) {
    grouping.add({turn_++, rig, stamp * us, arrival * us});
    return grouping.take_refused().empty();
  }
  /// The stamps of the next capture, by rigs; empty if it is not complete at this time.
  std::map<std::uint32_t, std::int64_t> next(std::int64_t now, bool at_once = false) {
    std::map<std::uint32_t, std::int64_t> stamps;
    for (const WaitingFrame& frame : grouping.next(now * us, at_once)) stamps[frame.rig] = frame.stamp_ns / us;
    return stamps;
  }
  CaptureGrouping grouping{2, {.window = std::chrono::microseconds(400), .wait = 5ms}, 1000};

 private:
  std::uint64_t turn_ = 0;
};

using Stamps = std::map<std::uint32_t, std::int64_t>;

}  // namespace

TEST_CASE("a capture is complete when every rig has a frame in the window") {
  Grouped frames;
  REQUIRE(frames.add(0, 1000, 1100));
  CHECK(frames.next(1200).empty());
  CHECK(frames.grouping.deadline_ns() == 6100 * us);
  REQUIRE(frames.add(1, 1300, 1500));
  CHECK(frames.next(1500) == Stamps{{0, 1000}, {1, 1300}});
  CHECK(frames.next(1500).empty());
  CHECK_FALSE(frames.grouping.deadline_ns());
}

// Until the impact shows that a clock is 3 ms behind or ahead, stamps that are equal make a capture.
TEST_CASE("after the correction of a clock, captures consist of frames of the same time, and none is refused") {
  for (const std::int64_t behind : {3000, -3000}) {
    CAPTURE(behind);
    Grouped frames;
    std::size_t captures = 0;
    for (std::int64_t time = 0; time < 40'000; time += 1000) {
      const bool is_corrected = time > 20'000;
      if (is_corrected) frames.grouping.correct_clocks(std::vector<std::int64_t>{0, behind * us});
      CHECK(frames.add(0, time, time + 100));
      CHECK(frames.add(1, time - behind, time + 200));
      for (Stamps capture = frames.next(time + 200); !capture.empty(); capture = frames.next(time + 200)) {
        ++captures;
        if (time > 24'000) CHECK((capture.size() == 2 && capture[0] == capture[1]));
      }
    }
    CHECK(captures > 36);
  }
}

TEST_CASE("a rig that lags behind by less than the wait is in its captures") {
  Grouped frames;
  std::vector<Stamps> captures;
  for (std::int64_t now = 0; now <= 20'000; now += 1000) {
    REQUIRE(frames.add(0, now, now));
    if (now >= 3000) REQUIRE(frames.add(1, now - 3000, now));
    for (Stamps stamps = frames.next(now); !stamps.empty(); stamps = frames.next(now)) captures.push_back(stamps);
  }
  REQUIRE(captures.size() == 18);
  for (std::size_t i = 0; i < captures.size(); ++i) {
    const auto stamp = static_cast<std::int64_t>(i) * 1000;
    CHECK(captures[i] == Stamps{{0, stamp}, {1, stamp}});
  }
}

TEST_CASE("no frame waits for a slower rig whose next frame is not due") {
  Grouped frames;
  for (std::int64_t now = 0; now <= 40'000; now += 1000) {
    CAPTURE(now);
    REQUIRE(frames.add(0, now, now));
    if (now % 10'000 == 0) REQUIRE(frames.add(1, now, now));
    if (now <= 10'000)
      while (!frames.next(now + 5000).empty()) {}
    else
      CHECK(frames.next(now).size() == (now % 10'000 == 0 ? 2 : 1));
  }
}

TEST_CASE("a silent rig is waited for once, and again after it has sent a frame") {
  Grouped frames;
  for (const std::int64_t now : {-1000, 0}) {
    for (const std::uint32_t rig : {0u, 1u}) REQUIRE(frames.add(rig, now, now));
    CHECK(frames.next(now).size() == 2);
  }
  REQUIRE(frames.add(0, 1000, 1000));
  CHECK(frames.next(5999).empty());
  CHECK(frames.next(6000) == Stamps{{0, 1000}});
  REQUIRE(frames.add(0, 7000, 7000));
  CHECK(frames.next(7000) == Stamps{{0, 7000}});
  for (const std::uint32_t rig : {0u, 1u}) REQUIRE(frames.add(rig, 8000, 8000));
  CHECK(frames.next(8000).size() == 2);
  REQUIRE(frames.add(0, 9000, 9000));
  CHECK(frames.next(9000).empty());
  frames.grouping.end(1);
  CHECK(frames.next(9000) == Stamps{{0, 9000}});
}

TEST_CASE("a frame belongs to the nearer of two frames of the other rig") {
  Grouped frames;
  REQUIRE(frames.add(0, 1000, 1000));
  REQUIRE(frames.add(0, 1500, 1500));
  REQUIRE(frames.add(1, 1390, 1600));
  CHECK(frames.next(1600) == Stamps{{0, 1000}});
  CHECK(frames.next(1600) == Stamps{{0, 1500}, {1, 1390}});
}

// Regression: after a correction of a clock, each capture consisted of frames that were one interval apart.
TEST_CASE("a frame is left to the next capture if its nearest frame is still to come") {
  Grouped frames;
  for (std::int64_t time = 0; time <= 2000; time += 350)
    for (const std::uint32_t rig : {0u, 1u}) REQUIRE(frames.add(rig, time, time + 100));
  while (frames.next(2000).size() == 2) {}
  REQUIRE(frames.add(1, 2100, 2200));
  CHECK(frames.next(2200).empty());
  REQUIRE(frames.add(0, 2450, 2500));  // its rig's frame of 2100 is missing, and the other rig's of 2450 is late
  CHECK(frames.next(2500) == Stamps{{1, 2100}});
  REQUIRE(frames.add(1, 2450, 2600));
  CHECK(frames.next(2600) == Stamps{{0, 2450}, {1, 2450}});
}

TEST_CASE("a frame that arrives after later ones were matched is refused, and its rig is waited for again") {
  Grouped frames;
  REQUIRE(frames.add(0, 10'000, 10'000));
  CHECK(frames.next(15'000) == Stamps{{0, 10'000}});  // in vain
  REQUIRE(frames.add(0, 16'000, 16'000));
  CHECK(frames.next(16'000) == Stamps{{0, 16'000}});
  CHECK_FALSE(frames.add(1, 15'990, 17'000));
  REQUIRE(frames.add(0, 17'000, 17'000));
  CHECK(frames.next(17'000).empty());
  REQUIRE(frames.add(1, 16'990, 18'000));
  CHECK(frames.next(18'000) == Stamps{{0, 17'000}, {1, 16'990}});
}

namespace {

/// Frames of both rigs at 1,000 per second, the right ones 10 us before the left ones; `change` may change the stamp
/// and the arrival of a frame or leave it out (false). Counts those that are in captures, by rigs.
template <class Change>
std::array<int, 2> in_captures(int frames, const Change& change) {
  Grouped grouped;
  struct Arrival {
    std::int64_t at = 0, stamp = 0;
    std::uint32_t rig = 0;
  };
  std::vector<Arrival> arrivals;
  for (int i = 0; i < frames; ++i)
    for (const std::uint32_t rig : {0u, 1u}) {
      const std::int64_t captured = 1000 * (i + 1) - (rig == 1 ? 10 : 0);
      Arrival arrival{captured + 200 + 2000 * rig, captured, rig};
      if (change(arrival.rig, i, arrival.stamp, arrival.at)) arrivals.push_back(arrival);
    }
  std::ranges::stable_sort(arrivals, {}, &Arrival::at);
  std::array<int, 2> counts{};
  const auto match = [&](std::int64_t now) {
    for (Stamps stamps = grouped.next(now); !stamps.empty(); stamps = grouped.next(now))
      for (const auto& [rig, stamp] : stamps) ++counts[rig];
  };
  for (const Arrival& arrival : arrivals) {
    match(arrival.at);
    static_cast<void>(grouped.add(arrival.rig, arrival.stamp, arrival.at));
    match(arrival.at);
  }
  match(arrivals.back().at + 100'000);
  return counts;
}

}  // namespace

// Each of these put a rig out of step for the rest of the test.
TEST_CASE("a gap, a stall or a late start costs a rig few frames") {
  const auto right = [](const auto& change) {
    const auto counts = in_captures(200, [&](std::uint32_t rig, int i, std::int64_t& stamp, std::int64_t& at) {
      return rig == 0 || change(i, stamp, at);
    });
    CHECK(counts[0] == 200);
    return counts[1];
  };
  CHECK(right([](int, std::int64_t&, std::int64_t&) { return true; }) == 200);
  CHECK(right([](int i, std::int64_t&, std::int64_t&) { return i < 50 || i > 80; }) >= 165);
  CHECK(right([](int i, std::int64_t&, std::int64_t&) { return i > 60; }) >= 135);
  CHECK(right([](int i, std::int64_t&, std::int64_t& at) {
          if (i > 50 && i < 80) at = 82'000;  // all at once
          return true;
        }) >= 165);
}

TEST_CASE("a rig whose clock or latency is wrong takes no frames from the other one") {
  using Change = std::function<void(int, std::int64_t& stamp, std::int64_t& at)>;
  const std::vector<std::pair<std::string, Change>> changes{
      {"one stamp ahead", [](int i, std::int64_t& stamp, std::int64_t&) { stamp += i == 50 ? 900'000 : 0; }},
      {"one stamp far ahead", [](int i, std::int64_t& stamp, std::int64_t&) { stamp += i == 50 ? 3'600'000'000 : 0; }},
      {"an hour ahead", [](int, std::int64_t& stamp, std::int64_t&) { stamp += 3'600'000'000; }},
      {"an hour behind", [](int, std::int64_t& stamp, std::int64_t&) { stamp -= 3'600'000'000; }},
      {"half a second ahead", [](int, std::int64_t& stamp, std::int64_t&) { stamp += 500'000; }},
      {"the clock is set", [](int i, std::int64_t& stamp, std::int64_t&) { stamp += i >= 50 ? 500'000 : 0; }},
      {"late", [](int, std::int64_t&, std::int64_t& at) { at += 30'000; }},
      {"seconds late for a while",
       [](int i, std::int64_t&, std::int64_t& at) { at += i >= 50 && i < 100 ? 2'000'000 : 0; }},
      {"late for a while", [](int i, std::int64_t&, std::int64_t& at) { at += i >= 50 && i < 100 ? 200'000 : 0; }}};
  for (const std::uint32_t wrong : {0u, 1u})
    for (const auto& named : changes) {
      CAPTURE(named.first);
      CAPTURE(wrong);
      const auto counts = in_captures(400, [&](std::uint32_t rig, int i, std::int64_t& stamp, std::int64_t& at) {
        if (rig == wrong) named.second(i, stamp, at);
        return true;
      });
      CHECK(counts[1 - wrong] >= 390);
    }
}

TEST_CASE("another test may begin at an earlier time") {
  Grouped frames;
  REQUIRE(frames.add(0, 50'000, 50'000));
  CHECK(frames.next(50'000, true) == Stamps{{0, 50'000}});
  frames.grouping.begin_test();
  REQUIRE(frames.add(0, 0, 60'000));
  CHECK(frames.next(60'000, true) == Stamps{{0, 0}});
}

namespace {

/// Whether the frame began another test.
bool add(RigTests& tests, std::uint32_t rig, std::uint64_t session, std::int64_t receive_ns) {
  const bool begins = tests.begins(rig, session, receive_ns);
  if (begins) tests.begin();
  tests.add(rig, session, receive_ns);
  return begins;
}

}  // namespace

TEST_CASE("a test goes on while one of its senders runs") {
  RigTests tests(2, 3s);
  CHECK(add(tests, 0, 7, 0));
  CHECK_FALSE(add(tests, 1, 8, 1 * ms));
  CHECK_FALSE(add(tests, 1, 9, 2 * ms));  // restarted
  CHECK_FALSE(add(tests, 1, 10, 3 * ms));
  tests.end(1, 9);  // of the former sender
  CHECK_FALSE(tests.closes(4 * ms));
  tests.end(1, 10);
  CHECK_FALSE(tests.closes(5 * ms));
  tests.end(0, 7);
  CHECK(tests.closes(6 * ms));
  CHECK_FALSE(tests.closes(6 * ms));
  CHECK(add(tests, 1, 10, 7 * ms));  // another test by the same senders
  CHECK_FALSE(add(tests, 0, 7, 8 * ms));
}

TEST_CASE("another test begins also if a sender of the former one says nothing or goes on") {
  RigTests silent(2, 3s), restarted(2, 3s), going_on(2, 3s), paused(2, 3s);
  for (RigTests* tests : {&silent, &restarted, &going_on, &paused}) {
    CHECK(add(*tests, 0, 7, 0));
    CHECK_FALSE(add(*tests, 1, 8, 0));
  }
  CHECK(add(silent, 0, 17, 3'100 * ms));
  CHECK_FALSE(add(restarted, 0, 17, 1 * ms));
  CHECK(add(restarted, 1, 18, 2 * ms));
  CHECK_FALSE(add(restarted, 0, 17, 3 * ms));
  going_on.end(0, 7);
  CHECK_FALSE(add(going_on, 0, 7, 2 * ms));  // the other one still sends
  going_on.end(1, 8);
  going_on.end(0, 7);
  CHECK(add(going_on, 0, 7, 3 * ms));
  paused.end(1, 8);
  CHECK(paused.closes(3'100 * ms));  // the other one has sent nothing for so long
  CHECK(add(paused, 0, 7, 3'200 * ms));
}
