// Runs programs whose n-th system call or allocation fails and checks what they leave.
#pragma once

#include "tests/support/program.hpp"
#include "tests/support/refusals.hpp"

#include <doctest/doctest.h>

#include <algorithm>
#include <cstdlib>
#include <string>
#include <vector>

namespace lbea::test {

inline bool is_long_run() { return std::getenv("LBEA_LONG_TESTS") != nullptr; }

inline constexpr std::chrono::seconds longest_run{60};  // of a program, which normally takes less than one second

struct Fault {
  std::string call;       // as in fail_nth.c
  unsigned long nth = 0;  // 0: none
};

/// The prefix of a command that runs with the fault, for files below `folder`. The number of calls is written to
/// `count`, the libraries that requested a failed allocation to a file beside it.
inline std::vector<std::string> with(const Fault& fault, const std::filesystem::path& folder,
                                     const std::filesystem::path& count) {
  return {"/usr/bin/env",
          "LD_PRELOAD=" LBEA_FAIL_NTH,
          "LBEA_FAULT_CALL=" + fault.call,
          "LBEA_FAULT_NTH=" + std::to_string(fault.nth),
          "LBEA_FAULT_PATH=" + folder.string(),
          "LBEA_FAULT_COUNT=" + count.string(),
          "LBEA_FAULT_ASKERS=" + count.string() + ".askers"};
}

inline unsigned long counted(const std::filesystem::path& count) {
  return std::strtoul(text_of(count).c_str(), nullptr, 10);
}

inline bool was_asked_by(const std::string& library, const std::filesystem::path& count) {
  const std::string askers = count.string() + ".askers";
  return std::filesystem::exists(askers) && contains(text_of(askers), library);
}

/// libzmq is a part of the program, or the system's library.
inline bool was_asked_by_zeromq(const std::string& program, const std::filesystem::path& count) {
  const std::string askers = count.string() + ".askers";
  if (!std::filesystem::exists(askers)) return false;
  const std::string functions =
      "sed -n 's|^" + program + " ||p' '" + askers + "' | xargs -r addr2line -f -e " + program;
  return was_asked_by("libzmq", count) ||
         contains(run_program("sh -c \"" + functions + "\"", count.parent_path()).out, "_ZN3zmq");
}

inline constexpr unsigned long all = ~0ul;

/// Numbers from 1 to `count`, including both: at most `most`, or `most_of_long` in a long run.
inline std::vector<unsigned long> chosen(unsigned long count, unsigned long most, unsigned long most_of_long = all) {
  std::vector<unsigned long> numbers;
  const unsigned long steps = std::min(count, is_long_run() ? most_of_long : most);
  for (unsigned long i = 0; i < steps; ++i) numbers.push_back(steps == 1 ? 1 : 1 + i * (count - 1) / (steps - 1));
  return numbers;
}

/// A program that reads files from elsewhere and writes one file into its working folder.
struct OneFile {
  std::string command, output;

  Outcome run(const Fault& fault, const TemporaryFolder& folder, const std::filesystem::path& count) const {
    std::string words;
    for (const std::string& word : with(fault, folder.path(), count)) words += "'" + word + "' ";
    return run_program(words + command, folder.path(), {}, longest_run);
  }
  void check(const std::string& call, unsigned long most, unsigned long most_of_long = all) const;

 private:
  void check_one(const Fault& fault, const std::string& undisturbed) const;
};

/// Fails each chosen call and checks exit code, message and files.
inline void OneFile::check(const std::string& call, unsigned long most, unsigned long most_of_long) const {
  const TemporaryFolder folder, elsewhere;
  const Outcome outcome = run({call, 0}, folder, elsewhere / "count");
  REQUIRE_MESSAGE(outcome.exit_code == 0, outcome.err);
  const std::string undisturbed = text_of(folder / output);
  REQUIRE_FALSE(undisturbed.empty());
  const std::vector<unsigned long> numbers = chosen(counted(elsewhere / "count"), most, most_of_long);
  CHECK((!numbers.empty() || call == "truncate"));  // not every program reserves disk space
  for (const unsigned long nth : numbers) check_one({call, nth}, undisturbed);
  MESSAGE(output << ": " << numbers.size() << " of " << counted(elsewhere / "count") << " calls of " << call
                 << " failed");
}

/// The file is whole, or it is absent and a message gives the reason. No other file is left.
inline void OneFile::check_one(const Fault& fault, const std::string& undisturbed) const {
  CAPTURE(fault.call);
  CAPTURE(fault.nth);
  const TemporaryFolder folder, elsewhere;
  const Outcome outcome = run(fault, folder, elsewhere / "count");
  CAPTURE(outcome.err);
  const bool is_there = std::filesystem::exists(folder / output);
  if (outcome.exit_code == 0) CHECK(is_there);
  // TBB, used by the ray casting library, ends the program when it cannot start a thread; the next bake removes what is
  // left.
  if (was_asked_by("libtbb", elsewhere / "count") && outcome.exit_code == 128 + SIGABRT) {
    CHECK_FALSE(is_there);
    return;
  }
  CHECK((outcome.exit_code == 0 || outcome.exit_code == 1));
  if (is_there) CHECK((text_of(folder / output) == undisturbed));
  const bool concerns_file = fault.call != "allocate" && fault.call != "thread";
  if (outcome.exit_code != 0) CHECK(contains(outcome.err, concerns_file ? output : "error: "));
  if (outcome.exit_code != 0 && concerns_file) CHECK_FALSE(is_there);
  CHECK(files_in(folder.path()) == (is_there ? 1 : 0));
}

}  // namespace lbea::test
