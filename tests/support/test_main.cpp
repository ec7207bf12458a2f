#define DOCTEST_CONFIG_IMPLEMENT
#include <doctest/doctest.h>

#include "tests/support/test_data.hpp"

#include <cstdio>
#include <filesystem>

namespace lbea::test {

bool& needs_reference_data() {
  static bool needed = false;
  return needed;
}

}  // namespace lbea::test

int main(int argc, char** argv) {
  if (lbea::test::needs_reference_data() && !std::filesystem::exists(lbea::test::reference_data())) {
    std::printf("skipped: no reference data at %s\n", lbea::test::reference_data().string().c_str());
    return 77;
  }
  doctest::Context context(argc, argv);
  return context.run();
}
