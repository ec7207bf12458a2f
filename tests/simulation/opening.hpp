// Files that cannot be opened as runs.
#pragma once

#include "adapters/simulation/open.hpp"
#include "tests/support/files.hpp"
#include "tests/support/refusals.hpp"
#include "tests/support/test_data.hpp"

namespace lbea::test {

/// The error of opening a run.
inline Error refusal(const std::filesystem::path& file) {
  return error_of([&] { static_cast<void>(io::open_simulation(file)); });
}

/// Checks that a file with this name and text is refused.
inline void check_refused(const std::string& name, const std::string& text, const std::vector<std::string>& words,
                          Status status) {
  const TemporaryFolder folder;
  CAPTURE(text);
  check_error(refusal(put(folder / name, text)), status, words);
}

}  // namespace lbea::test
