// The conformance files in this repository.
#include "tests/mcap/format/conformance.hpp"
#include "tests/support/test_data.hpp"

#include <doctest/doctest.h>

TEST_CASE("the conformance files of this repository are read as in their JSON") {
  CHECK(lbea::test::check_conformance(lbea::test::data() / "mcap") == 9);
}
