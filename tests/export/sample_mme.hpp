// A test with all that makes writing ISO-MME difficult.
#pragma once

#include "adapters/export/mme.hpp"

#include <cmath>
#include <limits>

namespace lbea::test {

inline io::MmeTest sample_mme() {
  constexpr double nan = std::numeric_limits<double>::quiet_NaN(), inf = std::numeric_limits<double>::infinity();
  io::MmeTest test;
  test.facts = {{"Type of the test", "impact"}, {"Comments", "two\nlines"}};
  const auto add = [&](const char* name, const char* dimension, char direction, std::uint32_t cfc,
                       std::vector<double> values) {
    const auto number = static_cast<std::uint32_t>(test.channels.size() + 1);
    test.channels.push_back({{number, dimension, direction, io::mme_filter(cfc)},
                             name,
                             dimension[0] == 'V' ? "m/s" : "m",
                             "camera",
                             cfc,
                             -0.0015,
                             0.00075,
                             std::move(values)});
  };
  add("  struck end  ", "DS", 'X', 0, {0.1, -1.25e-7, 1.0 / 3, -97.2103500366211, 1e9 / 7, 0});
  add("Träger, \"oben\" 'links'", "VE", 'R', 60, {nan, 2.5, inf, -3, nan});
  add("of\ntwo\r\nlines\tand\x1b controls\xc2\x85\xe2\x80\xa8", "AC", 'Z', 180, {1, 2, 3});
  add("never seen", "DC", 'R', 0, {nan, nan, nan});
  add("once", "DS", 'Y', 1000, {42.5});
  add("", "DS", 'Y', 30, {1, 1});
  for (int i = 0; i < 3; ++i) add("many", "DS", 'X', 0, std::vector<double>(1500, 0.25 * i));
  return test;
}

}  // namespace lbea::test
