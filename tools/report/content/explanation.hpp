// What the test says, in plain sentences: the verdict, what it means, what to do.
#pragma once

#include "tools/report/content/test_record.hpp"

namespace lbea::tool {

/// What the sentences are made of.
struct TestFacts {
  const TestRecord* record = nullptr;   // null: no frame was matched
  std::string refusal;                  // why no frame was matched, or empty
  std::vector<std::string> names;       // of the simulations
  std::vector<std::uint32_t> branches;  // per simulation
  std::string method, length_unit;
  double test_limit = static_cast<double>(FrameRow::unknown);  // of the test's misfit
};

struct Explanation {
  enum class Tone : std::uint8_t { good, open, bad };
  Tone tone = Tone::open;
  std::string word;      // "A simulation fits", ...
  std::string headline;  // one sentence
  std::string meaning;
  std::string action;
  std::string answer;  // to "Does a simulation fit?": one or two words
};
[[nodiscard]] Explanation explain(const TestFacts& facts);
/// Advises to read the warnings before all else. of: empty, or the components that have some.
void add_doubt(Explanation& explanation, const std::string& of = "");

/// The state of the test after its last frame.
struct Likeliest {
  std::uint32_t branch = 0;
  double branch_probability = static_cast<double>(FrameRow::unknown);
  std::size_t branches = 0;
};
[[nodiscard]] Likeliest likeliest_branch(const wire::WireTestState& state);

/// The name of a simulation, or its number.
[[nodiscard]] std::string simulation_name(std::span<const std::string> names, std::uint32_t simulation);

}  // namespace lbea::tool
