// Shared by the wire tests: polling with a timeout, errors as text, other processes.
#pragma once

#include "tests/support/files.hpp"
#include "tests/support/program.hpp"
#include "tests/support/refusals.hpp"

#include <chrono>
#include <thread>

namespace lbea::test {

/// Polls until `holds` returns true, for at most `most` (long enough for loaded machines and sanitizers).
template <class Predicate>
bool eventually(Predicate holds, std::chrono::seconds most = std::chrono::seconds(30)) {
  const auto deadline = std::chrono::steady_clock::now() + most;
  while (std::chrono::steady_clock::now() < deadline) {
    if (holds()) return true;
    std::this_thread::sleep_for(std::chrono::milliseconds(2));
  }
  return holds();
}

}  // namespace lbea::test
