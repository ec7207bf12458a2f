#include <lbea/lbea.hpp>

#include <doctest/doctest.h>

#include <set>

using namespace lbea;

TEST_CASE("every status has a name of its own, every other number none") {
  std::set<std::string_view> names;
  for (std::int32_t s = 0; s < status_count; ++s) names.insert(to_string(static_cast<Status>(s)));
  CHECK(names.size() == status_count);
  CHECK_FALSE(names.contains("unknown_status"));
  CHECK(to_string(static_cast<Status>(status_count)) == "unknown_status");
  CHECK(to_string(static_cast<Status>(-1)) == "unknown_status");
}
