// SIGSTOP: the matcher, the recorder before it, the sender and the monitor stand still in turn while frames go on. The others
// wait or count; nobody's account is off by a frame afterwards.
#include "tests/support/program.hpp"
#include "tests/support/refusals.hpp"
#include "tests/support/test_data.hpp"
#include "tests/wire/wire_support.hpp"

#include <lbea/lbea.hpp>

#include <doctest/doctest.h>
#include <nlohmann/json.hpp>

#include <cstdlib>
#include <fstream>
#include <random>

using namespace lbea;
using namespace lbea::test;
using namespace std::chrono_literals;
using Json = nlohmann::json;

namespace {

class Chain {
 public:
  explicit Chain(int frames) {
    const Model model = Model::open(LBEA_MODEL);
    const auto positions = model.node_positions(0);
    std::ofstream cloud(file("cloud.xyz"));
    for (std::size_t i = 0; i + 2 < positions.size(); i += 3) cloud << positions[i] << ' ' << positions[i + 1] << ' ' << positions[i + 2] << '\n';
    cloud.close();
    add("serve", {LBEA_SERVE, LBEA_MODEL, "--frames", at("frames"), "--results", at("results"), "--json", "--queue", "64"}, "ready: ");
    add("record", {LBEA_RECORD, file("run.mcap"), "--frames", at("rig"), "--forward", at("frames"), "--results", at("results"), "--record-memory", "64", "--json"}, "ready: ");
#ifdef LBEA_MONITOR_PROGRAM
    add("monitor", {LBEA_MONITOR_PROGRAM, "--results", at("results"), "--http", "127.0.0.1:0"}, "http://");
#endif
    std::this_thread::sleep_for(300ms);  // until the way from the recorder to the matcher stands
    add("send", {LBEA_SEND, file("cloud.xyz"), "--to", at("rig"), "--results", at("results"), "--rate", "400", "--loop", std::to_string(frames), "--json"}, "");
  }
  void freeze(const std::string& name, std::chrono::milliseconds time) {
    CAPTURE(name);
    of(name).signal(SIGSTOP);
    std::this_thread::sleep_for(time);
    of(name).signal(SIGCONT);
  }
  int end(const std::string& name, int signal = 0) {
    if (signal != 0) of(name).signal(signal);
    return of(name).wait();
  }
  [[nodiscard]] Json said(const std::string& name) const {
    const std::string text = text_of(file(name + ".out"));
    CAPTURE(text);
    CAPTURE(text_of(file(name + ".err")));
    const Json json = Json::parse(text, nullptr, false);
    REQUIRE(json.is_object());
    return json;
  }
  [[nodiscard]] std::vector<std::string> names() const {
    std::vector<std::string> all;
    for (const auto& [name, process] : processes_) all.push_back(name);
    return all;
  }
  [[nodiscard]] std::string file(const std::string& name) const { return (folder / name).string(); }
  TemporaryFolder folder;

 private:
  [[nodiscard]] std::string at(const std::string& name) const { return "ipc://" + file(name); }
  void add(const std::string& name, const std::vector<std::string>& words, const std::string& ready) {
    processes_.emplace_back(name, std::make_unique<Process>(words, file(name + ".out"), file(name + ".err")));
    if (!ready.empty()) REQUIRE(eventually([&] { return contains(text_of(file(name + ".err")) + text_of(file(name + ".out")), ready); }));
  }
  Process& of(const std::string& name) {
    for (const auto& [its, process] : processes_)
      if (its == name) return *process;
    throw std::out_of_range(name);
  }
  std::vector<std::pair<std::string, std::unique_ptr<Process>>> processes_;
};

}  // namespace

TEST_CASE("each process stands still for a while: every frame is in its account afterwards") {
  const int rounds = std::getenv("LBEA_LONG_TESTS") != nullptr ? 40 : 2;
  const std::uint64_t frames = 800u * static_cast<unsigned>(rounds);
  Chain chain(static_cast<int>(frames));
  std::mt19937 random(4);
  for (int round = 0; round < rounds; ++round)
    for (const std::string& name : chain.names()) {
      chain.freeze(name, std::chrono::milliseconds(50 + random() % 350));
      std::this_thread::sleep_for(100ms);
    }
  static_cast<void>(chain.end("send"));  // 1 when frames were refused
  CHECK(eventually([&] { return contains(text_of(chain.file("serve.err")), "end of stream"); }));
  std::this_thread::sleep_for(200ms);
  static_cast<void>(chain.end("record", SIGINT));
  static_cast<void>(chain.end("serve", SIGINT));
  const Json sent = chain.said("send"), recorded = chain.said("record"), served = chain.said("serve");
  MESSAGE("sender " << sent.dump() << "\nrecorder " << recorded.dump() << "\nmatcher " << served.dump());
  CHECK(sent["captured"] == frames);
  CHECK(sent["sent"].get<std::uint64_t>() + sent["refused"].get<std::uint64_t>() == frames);
  const Json& receipt = sent["receipt"];
  CHECK(receipt["received"].get<std::uint64_t>() + receipt["withheld"].get<std::uint64_t>() + receipt["missed"].get<std::uint64_t>() == frames);
  CHECK(receipt["withheld"] == sent["refused"]);
  CHECK(recorded["received"] == sent["sent"]);
  CHECK(recorded["recorded"] == recorded["received"]);
  CHECK(recorded["forwarded"].get<std::uint64_t>() + recorded["refused"].get<std::uint64_t>() == recorded["received"].get<std::uint64_t>());
  CHECK(served["adds_up"] == true);
  CHECK(served["captured"] == frames);
  CHECK(served["received"] == recorded["forwarded"]);
  const Outcome report = run_program(LBEA_INSPECT " run.mcap --json", chain.folder.path());
  CHECK(Json::parse(report.out)["frames"] == recorded["recorded"]);
}
