// Small text files and what reading them throws.
#pragma once

#include "adapters/file/atomic_file.hpp"
#include "tests/support/test_data.hpp"

#include <lbea/lbea.hpp>

#include <string>

namespace lbea::test {

inline std::filesystem::path put(const std::filesystem::path& path, const std::string& text) {
  std::filesystem::create_directories(path.parent_path());
  AtomicFile file(path);
  file.write(text);
  file.commit();
  return path;
}

template <class Body>
Error error_of(Body body) {
  try {
    body();
  } catch (const Error& error) {
    return error;
  }
  return {Status::ok, ""};
}

inline bool mentions(const Error& error, const std::string& text) {
  return std::string(error.what()).find(text) != std::string::npos;
}

}  // namespace lbea::test
