#include "adapters/wire/sockets/spsc_ring.hpp"

#include <doctest/doctest.h>

#include <algorithm>
#include <atomic>
#include <thread>

using namespace lbea;
using namespace lbea::wire;

TEST_CASE("a ring holds as many as it has slots, in order") {
  for (const std::size_t slots : {1u, 2u, 5u}) {
    CAPTURE(slots);
    SpscRing<int> ring(slots);
    CHECK(ring.capacity() == slots);
    CHECK(ring.front() == nullptr);
    for (int round = 0; round < 3; ++round) {
      for (std::size_t i = 0; i < slots; ++i) {
        REQUIRE(ring.claim() != nullptr);
        *ring.claim() = static_cast<int>(i);
        ring.publish();
      }
      CHECK(ring.used() == slots);
      CHECK(ring.claim() == nullptr);
      for (std::size_t i = 0; i < slots; ++i) {
        REQUIRE(ring.front() != nullptr);
        CHECK(*ring.front() == static_cast<int>(i));
        ring.release();
      }
      CHECK(ring.used() == 0);
      CHECK(ring.front() == nullptr);
    }
  }
}

TEST_CASE("what is claimed is not seen before it is published") {
  SpscRing<int> ring(2);
  *ring.claim() = 1;
  CHECK(ring.front() == nullptr);
  ring.publish();
  CHECK(*ring.front() == 1);
}

// A state once could say that four thousand million frames wait: the two ends were read in the wrong order.
TEST_CASE("a third thread never sees more used than there are slots") {
  SpscRing<int> ring(3);
  std::atomic<bool> done{false};
  std::thread mover([&] {
    for (int i = 0; i < 2'000'000; ++i) {
      ring.publish();
      ring.release();
    }
    done = true;
  });
  std::size_t most = 0;
  while (!done) most = std::max(most, ring.used());
  mover.join();
  CHECK(most <= 3);
  CHECK(ring.used() == 0);
}

TEST_CASE("two threads: everything arrives once, whole and in order") {
  struct Item {
    std::uint64_t number = 0, doubled = 0;
  };
  constexpr std::uint64_t items = 300'000;
  SpscRing<Item> ring(7);
  Doorbell bell;
  std::thread producer([&] {
    for (std::uint64_t i = 0; i < items;) {
      if (Item* slot = ring.claim()) {
        *slot = {i, 2 * i};
        ring.publish();
        if (++i % 64 == 0) bell.ring();
      } else {
        bell.ring();
        std::this_thread::yield();
      }
    }
    bell.ring();
  });
  std::uint64_t wrong = 0;
  for (std::uint64_t i = 0; i < items;) {
    if (const Item* item = ring.front()) {
      wrong += item->number != i || item->doubled != 2 * i;
      ring.release();
      ++i;
    } else {
      bell.wait_for(std::chrono::milliseconds(10));
    }
  }
  producer.join();
  CHECK(wrong == 0);
  CHECK(ring.used() == 0);
}

TEST_CASE("a bell rung before the wait is heard, an unrung one times out") {
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
