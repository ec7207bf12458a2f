// Runs lbea-bake on the demo.
#pragma once

#include "tests/support/program.hpp"

#include <string>

namespace lbea::test {

inline const std::string demo = (data() / "rail-demo").string();

inline Outcome lbea_bake(const TemporaryFolder& folder, const std::string& arguments) {
  return run_program(std::string(LBEA_BAKE) + " " + arguments, folder.path());
}

}  // namespace lbea::test
