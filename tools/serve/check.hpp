// lbea-serve --check.
#pragma once

#include "tools/serve/command_line.hpp"

namespace lbea::tool {

/// Tries everything that can be tried without frames, prints what it found; the exit code.
int check(const ServeOptions& options);

}  // namespace lbea::tool
