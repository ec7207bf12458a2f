// The MCAP project's conformance files: every record as their JSON lists it, and nothing to complain about.
#include "tests/mcap/conformance.hpp"
#include "tests/support/test_data.hpp"

#include <doctest/doctest.h>

TEST_CASE("all conformance files are read as their JSON says") {
  CHECK(lbea::test::check_conformance(lbea::test::reference_data() / "mcap/conformance") == 416);
}
