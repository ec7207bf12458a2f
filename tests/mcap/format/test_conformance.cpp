// The MCAP project's conformance files: every record equals their JSON, and no error is found.
#include "tests/mcap/format/conformance.hpp"
#include "tests/support/test_data.hpp"

#include <doctest/doctest.h>

TEST_CASE("all conformance files are read as in their JSON") {
  CHECK(lbea::test::check_conformance(lbea::test::reference_data() / "mcap/conformance") == 416);
}
