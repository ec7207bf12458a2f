// On what, by what and when a measurement was made.
#pragma once

#include <string>
#include <utility>
#include <vector>

namespace lbea::tool::bench {

/// Named facts in the order of print: machine, cores, load, commit, compiler, flags, kernels, date.
[[nodiscard]] std::vector<std::pair<std::string, std::string>> circumstances();

}  // namespace lbea::tool::bench
