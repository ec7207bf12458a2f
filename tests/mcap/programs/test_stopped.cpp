// SIGSTOP for the matcher, the recorder, the sender and the monitor in turn while frames are sent. The others wait or
// count; afterwards all counters are exact.
#include "tests/mcap/chain.hpp"

#include <cstdlib>
#include <random>

using namespace lbea;
using namespace lbea::test;
using namespace std::chrono_literals;
using Json = nlohmann::json;

TEST_CASE("each process is stopped for a while: every frame is counted afterwards") {
  const int rounds = std::getenv("LBEA_LONG_TESTS") != nullptr ? 40 : 2;
  const std::uint64_t frames = 800u * static_cast<unsigned>(rounds);
  Chain chain(static_cast<int>(frames));
  std::mt19937 random(4);
  for (int round = 0; round < rounds; ++round)
    for (const std::string& name : Chain::names()) {
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
  CHECK(receipt["received"].get<std::uint64_t>() + receipt["withheld"].get<std::uint64_t>() +
            receipt["missed"].get<std::uint64_t>() ==
        frames);
  CHECK(receipt["withheld"] == sent["refused"]);
  CHECK(recorded["received"] == sent["sent"]);
  CHECK(recorded["recorded"] == recorded["received"]);
  CHECK(recorded["forwarded"].get<std::uint64_t>() + recorded["refused"].get<std::uint64_t>() ==
        recorded["received"].get<std::uint64_t>());
  CHECK(served["adds_up"] == true);
  CHECK(served["captured"] == frames);
  CHECK(served["received"] == recorded["forwarded"]);
  const Outcome report = run_program(LBEA_INSPECT " " + chain.recording() + " --json", chain.folder.path());
  CHECK(Json::parse(report.out)["frames"] == recorded["recorded"]);
}
