// Checks of the errors that calls throw.
#pragma once

#include <doctest/doctest.h>
#include <lbea/lbea.hpp>

#include <string>
#include <vector>

namespace lbea::test {

/// The Error that `body` throws; Status::ok and an empty message when it throws none.
template <class Body>
Error error_of(Body body) {
  try {
    body();
  } catch (const Error& error) { return error; }
  return {Status::ok, ""};
}

inline bool contains(const std::string& text, const std::string& part) { return text.find(part) != std::string::npos; }

inline bool mentions(const Error& error, const std::string& text) { return contains(error.what(), text); }

/// Checks the status and that the message contains all `words`.
inline void check_error(const Error& error, Status status, const std::vector<std::string>& words) {
  CAPTURE(error.what());
  CHECK(error.status == status);
  for (const std::string& word : words) {
    CAPTURE(word);
    CHECK(mentions(error, word));
  }
}

}  // namespace lbea::test
