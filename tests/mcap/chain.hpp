// The programs of a rig in a chain: sender, recorder, matcher, and the monitor if it is built. Real processes, sockets
// and files.
#pragma once

#include "tests/support/program.hpp"
#include "tests/support/test_data.hpp"
#include "tests/wire/wire_support.hpp"

#include <lbea/lbea.hpp>

#include <doctest/doctest.h>
#include <nlohmann/json.hpp>

#include <fstream>
#include <map>
#include <memory>

namespace lbea::test {

class Chain {
 public:
  using Json = nlohmann::json;

  /// The sender sends `frames` captures at 400 per second.
  explicit Chain(int frames) : frames_(frames) {
    const Model model = Model::open(LBEA_MODEL);
    const auto positions = model.node_positions(0);
    std::ofstream cloud(file("cloud.xyz"));
    for (std::size_t i = 0; i + 2 < positions.size(); i += 3)
      cloud << positions[i] << ' ' << positions[i + 1] << ' ' << positions[i + 2] << '\n';
    cloud.close();
    for (const std::string& name : names()) {
      if (name == "send")
        std::this_thread::sleep_for(std::chrono::milliseconds(300));  // until the recorder is connected to the matcher
      start(name);
    }
  }
  [[nodiscard]] static std::vector<std::string> names() {
#ifdef LBEA_MONITOR_PROGRAM
    return {"serve", "record", "monitor", "send"};
#else
    return {"serve", "record", "send"};
#endif
  }
  /// Waits until the program is ready (the sender: until it runs). A restarted recorder starts another recording.
  void start(const std::string& name) {
    CAPTURE(name);
    if (name == "record") ++recordings_;
    std::filesystem::remove(file(name + ".err"));
    processes_[name] = std::make_unique<Process>(words_of(name), file(name + ".out"), file(name + ".err"));
    const auto is_said = [&] {
      return name == "send" || contains(text_of(file(name + ".err")) + text_of(file(name + ".out")),
                                        name == "monitor" ? "http://" : "ready: ");
    };
    // The monitor has the lowest priority: beside other work it starts late.
    const bool is_ready = eventually(is_said, std::chrono::seconds(name == "monitor" ? 300 : 30));
    REQUIRE_MESSAGE(is_ready, text_of(file(name + ".err")));
  }
  Process& of(const std::string& name) { return *processes_.at(name); }
  void freeze(const std::string& name, std::chrono::milliseconds time) {
    of(name).signal(SIGSTOP);
    std::this_thread::sleep_for(time);
    of(name).signal(SIGCONT);
  }
  int end(const std::string& name, int signal = 0) {
    if (signal != 0) of(name).signal(signal);
    return of(name).wait();
  }
  /// What a program printed at its end.
  [[nodiscard]] Json said(const std::string& name) const {
    const std::string text = text_of(file(name + ".out"));
    CAPTURE(text);
    CAPTURE(text_of(file(name + ".err")));
    const Json json = Json::parse(text, nullptr, false);
    REQUIRE(json.is_object());
    return json;
  }
  [[nodiscard]] std::string file(const std::string& name) const { return (folder / name).string(); }
  /// The latest recording.
  [[nodiscard]] std::string recording() const { return "run-" + std::to_string(recordings_) + ".mcap"; }
  TemporaryFolder folder;

 private:
  [[nodiscard]] std::string at(const std::string& name) const { return "ipc://" + file(name); }
  [[nodiscard]] std::vector<std::string> words_of(const std::string& name) const {
    if (name == "serve")
      return {LBEA_SERVE, LBEA_MODEL, "--frames", at("frames"),   "--results", at("results"),
              "--json",   "--queue",  "64",       "--max-points", "32768"};
    if (name == "record")
      return {LBEA_RECORD, file(recording()), "--frames",        at("rig"), "--forward", at("frames"),
              "--results", at("results"),     "--record-memory", "64",      "--json"};
#ifdef LBEA_MONITOR_PROGRAM
    if (name == "monitor") return {LBEA_MONITOR_PROGRAM, "--results", at("results"), "--http", "127.0.0.1:0"};
#endif
    return {LBEA_SEND, file("cloud.xyz"),       "--to",  at("rig"), "--results", at("results"), "--rate", "400",
            "--loop",  std::to_string(frames_), "--json"};
  }
  int frames_, recordings_ = 0;
  std::map<std::string, std::unique_ptr<Process>> processes_;
};

}  // namespace lbea::test
