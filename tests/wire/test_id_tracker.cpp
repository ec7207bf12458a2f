#include "adapters/wire/id_tracker.hpp"

#include <doctest/doctest.h>

#include <limits>

using lbea::IdTracker;

TEST_CASE("gaps and repetitions within a session") {
  IdTracker ids;
  for (const std::uint64_t id : {10u, 11u, 14u, 14u, 12u, 15u}) ids.saw(1, id);
  CHECK(ids.missed() == 2);      // 12 and 13 when 14 came
  CHECK(ids.duplicates() == 2);  // 14 again, 12 late
  CHECK(ids.sessions() == 1);
}

TEST_CASE("sessions do not disturb each other") {
  IdTracker ids;
  for (std::uint64_t id = 0; id < 100; ++id) {
    ids.saw(1, id);
    ids.saw(2, 1000 + id);
  }
  CHECK(ids.missed() == 0);
  CHECK(ids.duplicates() == 0);
  CHECK(ids.sessions() == 2);
}

TEST_CASE("extreme ids saturate") {
  constexpr auto last = std::numeric_limits<std::uint64_t>::max();
  IdTracker ids;
  ids.saw(1, 0);
  ids.saw(1, last);
  ids.saw(2, 0);
  ids.saw(2, last);
  CHECK(ids.missed() == last);
}

TEST_CASE("many sessions: the least recently used one is forgotten, memory stays bounded") {
  IdTracker ids;
  for (std::uint64_t session = 0; session < 10'000; ++session) {
    ids.saw(session, 5);
    ids.saw(12'345, session);  // never the least recent
  }
  CHECK(ids.sessions() == 10'001);
  CHECK(ids.missed() == 0);
  CHECK(ids.duplicates() == 0);
  ids.saw(0, 5);  // forgotten long ago: a new session
  CHECK(ids.sessions() == 10'002);
}
