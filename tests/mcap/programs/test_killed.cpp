// SIGKILL for any program of the chain at any time while frames are sent. The others continue, the killed one can be
// restarted at once at the same endpoints, and its recording can be recovered.
#include "tests/mcap/chain.hpp"

#include <cstdlib>
#include <random>

using namespace lbea;
using namespace lbea::test;
using namespace std::chrono_literals;
using Json = nlohmann::json;

namespace {

/// The frames that can be recovered from a recording.
std::uint64_t recovered(const Chain& chain, const std::string& recording) {
  const Outcome recovery =
      run_program(LBEA_INSPECT " --recover " + recording + ".partial -o fixed-" + recording, chain.folder.path());
  CHECK_MESSAGE(recovery.exit_code == 0, recovery.err);
  const Json report = Json::parse(run_program(LBEA_INSPECT " fixed-" + recording + " --json", chain.folder.path()).out);
  CHECK(report["intact"] == true);
  return report["frames"].get<std::uint64_t>();
}

}  // namespace

TEST_CASE(
    "each process is killed and restarted repeatedly: the others continue, counters add up, recordings are recovered") {
  const int rounds = std::getenv("LBEA_LONG_TESTS") != nullptr ? 100 : 3;
  Chain chain(1'000'000);
  std::mt19937 random(6);
  std::vector<std::string> cut;
  for (int round = 0; round < rounds; ++round)
    for (const std::string& name : Chain::names()) {
      CAPTURE(round);
      CAPTURE(name);
      std::this_thread::sleep_for(std::chrono::milliseconds(random() % 200));
      if (name == "record") cut.push_back(chain.recording());
      CHECK(chain.end(name, SIGKILL) == 128 + SIGKILL);
      for (const std::string& other : Chain::names()) CHECK((other == name || chain.of(other).is_running()));
      chain.start(name);
    }
  std::this_thread::sleep_for(500ms);
  static_cast<void>(chain.end("send", SIGINT));
  std::this_thread::sleep_for(200ms);
  static_cast<void>(chain.end("record", SIGINT));
  static_cast<void>(chain.end("serve", SIGINT));
  const Json recorded = chain.said("record"), served = chain.said("serve");
  CHECK(served["adds_up"] == true);
  CHECK(served["matched"].get<std::uint64_t>() > 0);
  CHECK(recorded["recorded"] == recorded["received"]);
  CHECK(Json::parse(run_program(LBEA_INSPECT " " + chain.recording() + " --json", chain.folder.path()).out)["frames"] ==
        recorded["recorded"]);
  std::uint64_t frames = 0;
  for (const std::string& recording : cut) frames += recovered(chain, recording);
  MESSAGE(cut.size() << " recordings cut off, " << frames << " frames recovered");
  CHECK(frames > 0);
}
