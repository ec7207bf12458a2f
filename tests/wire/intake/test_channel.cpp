#include "tools/shared/intake/channel.hpp"

#include <doctest/doctest.h>

#include <algorithm>
#include <atomic>
#include <thread>

using namespace lbea;
using namespace lbea::tool;

TEST_CASE("a channel holds as many as it has slots, in order") {
  for (const std::size_t slots : {1u, 2u, 5u}) {
    CAPTURE(slots);
    Channel<int> channel(slots);
    CHECK(channel.capacity() == slots);
    CHECK(channel.front() == nullptr);
    for (int round = 0; round < 3; ++round) {
      for (std::size_t i = 0; i < slots; ++i) {
        REQUIRE(channel.claim() != nullptr);
        *channel.claim() = static_cast<int>(i);
        channel.publish();
      }
      CHECK(channel.used() == slots);
      CHECK(channel.claim() == nullptr);
      for (std::size_t i = 0; i < slots; ++i) {
        REQUIRE(channel.front() != nullptr);
        CHECK(*channel.front() == static_cast<int>(i));
        channel.release();
      }
      CHECK(channel.used() == 0);
      CHECK(channel.front() == nullptr);
    }
  }
}

TEST_CASE("a claimed slot is not visible before it is published") {
  Channel<int> channel(2);
  *channel.claim() = 1;
  CHECK(channel.front() == nullptr);
  channel.publish();
  CHECK(*channel.front() == 1);
}

// Regression: a state reported 2^32 waiting frames because the two ends were read in the wrong order.
TEST_CASE("a third thread never sees more used than there are slots") {
  Channel<int> channel(3);
  std::atomic<bool> done{false};
  std::thread mover([&] {
    for (int i = 0; i < 2'000'000; ++i) {
      channel.publish();
      channel.release();
    }
    done = true;
  });
  std::size_t most = 0;
  while (!done) most = std::max(most, channel.used());
  mover.join();
  CHECK(most <= 3);
  CHECK(channel.used() == 0);
}

TEST_CASE("two threads: everything arrives once, whole and in order") {
  struct Item {
    std::uint64_t number = 0, doubled = 0;
  };
  constexpr std::uint64_t items = 300'000;  // each rings the bell
  Doorbell bell;
  Channel<Item> channel(7, &bell);
  std::thread producer([&] {
    for (std::uint64_t i = 0; i < items; ++i) {
      channel.wait_and_claim() = {i, 2 * i};
      channel.publish();
    }
    channel.close();
  });
  std::uint64_t wrong = 0;
  for (std::uint64_t i = 0; i < items;) {
    if (const Item* item = channel.front()) {
      wrong += item->number != i || item->doubled != 2 * i;
      channel.release();
      ++i;
    } else {
      bell.wait_for(std::chrono::milliseconds(10));
    }
  }
  producer.join();
  CHECK(wrong == 0);
  CHECK(channel.used() == 0);
  CHECK(channel.closed());
}

TEST_CASE("push reports a full channel; close wakes the consumer, also through a shared bell") {
  Doorbell bell;
  Channel<int> one(1, &bell), two(2, &bell);
  CHECK(one.push(7));
  CHECK_FALSE(one.push(8));
  CHECK(*one.front() == 7);
  CHECK_FALSE(two.closed());
  bell.wait_for(std::chrono::seconds(20));  // push has rung it
  const auto begin = std::chrono::steady_clock::now();
  std::thread producer([&] {
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
    two.close();
  });
  bell.wait_for(std::chrono::seconds(20));
  CHECK(std::chrono::steady_clock::now() - begin < std::chrono::seconds(10));
  producer.join();
  CHECK(two.closed());
  CHECK_FALSE(one.closed());
}

TEST_CASE("a waiting producer gets the slot that the consumer releases") {
  Channel<int> channel(1);
  CHECK(channel.push(1));
  std::thread consumer([&] {
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
    channel.release();
  });
  channel.wait_and_claim() = 2;
  CHECK(channel.used() == 0);
  channel.publish();
  consumer.join();
  CHECK(*channel.front() == 2);
}

TEST_CASE("a ring before the wait ends it at once; without one it times out") {
  using Clock = std::chrono::steady_clock;
  Doorbell bell;
  bell.ring();
  bell.ring();
  const auto begin = Clock::now();
  bell.wait_for(std::chrono::seconds(20));
  CHECK(Clock::now() - begin < std::chrono::seconds(10));
  const auto second = Clock::now();
  bell.wait_for(std::chrono::milliseconds(20));
  CHECK(Clock::now() - second >= std::chrono::milliseconds(20));
}
