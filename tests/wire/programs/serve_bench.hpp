// lbea-serve as a process, with its endpoints and log in a temporary folder.
#pragma once

#include "tests/support/test_data.hpp"
#include "tests/wire/wire_support.hpp"

#include <doctest/doctest.h>

#include <fstream>
#include <memory>

namespace lbea::test {

class ServeBench {
 public:
  ServeBench() { std::ofstream(file("cloud.xyz")) << "1 2 3\n4 5 6\n"; }
  std::unique_ptr<Process> start(const std::string& program, std::vector<std::string> arguments,
                                 const std::string& name) {
    arguments.insert(arguments.begin(), program);
    return std::make_unique<Process>(arguments, file(name + ".out"), file(name + ".err"));
  }
  std::unique_ptr<Process> serve(std::vector<std::string> more = {}) {
    std::vector<std::string> arguments{LBEA_MODEL, "--frames", frames, "--results", results, "--json"};
    arguments.insert(arguments.end(), more.begin(), more.end());
    auto process = start(LBEA_SERVE, arguments, "serve");
    REQUIRE(eventually([&] { return contains(said(), "ready: frames on "); }));
    return process;
  }
  int send(std::vector<std::string> more = {}) {
    std::vector<std::string> arguments{file("cloud.xyz"), "--to", word_after("frames on "), "--json"};
    arguments.insert(arguments.end(), more.begin(), more.end());
    return start(LBEA_SEND, arguments, "send")->wait();
  }
  void make_key(const std::string& name) { REQUIRE(start(LBEA_KEYGEN, {file(name)}, "keygen")->wait() == 0); }
  [[nodiscard]] std::string file(const std::string& name) const { return (folder / name).string(); }
  [[nodiscard]] std::string said() const { return text_of(file("serve.err")); }
  /// The server's log after `words`, up to a blank or comma.
  [[nodiscard]] std::string word_after(const std::string& words) const {
    const std::string text = said();
    const auto at = text.find(words);
    REQUIRE(at != std::string::npos);
    const auto begin = at + words.size();
    return text.substr(begin, text.find_first_of(", \n", begin) - begin);
  }

  test::TemporaryFolder folder;
  std::string frames = "ipc://" + file("frames"), results = "ipc://" + file("results");
};

}  // namespace lbea::test
