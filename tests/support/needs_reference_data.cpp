#include "tests/support/test_data.hpp"

namespace {
[[maybe_unused]] const bool declared = lbea::test::needs_reference_data() = true;
}
