// Any call fails during a recording: every loss is reported, and everything reported as recorded is in the file.
#include "tests/faults/recordings.hpp"
#include "tests/mcap/format/mcap_support.hpp"

#include <nlohmann/json.hpp>

using namespace lbea;
using namespace lbea::mcap;
using namespace lbea::wire;
using namespace lbea::test;
using Json = nlohmann::json;

namespace {

/// The number of frames in the file, or recovered from its .partial file.
std::uint64_t frames_left(const TemporaryFolder& folder) {
  const auto file = folder / "run.mcap";
  if (std::filesystem::exists(file)) {
    CHECK(mcap::check_file(mcap::FileSource(file)).is_intact());
    return frames_in(mcap::FileSource(file));
  }
  if (!std::filesystem::exists(mcap::partial_name(file)) || std::filesystem::file_size(mcap::partial_name(file)) == 0)
    return 0;
  MemorySink sink;
  mcap::recover(mcap::FileSource(mcap::partial_name(file)), sink);
  return frames_in(mcap::MemorySource(sink.bytes, "recovered"));
}

/// Without memory, ZeroMQ ends the program or the connection with everything it had read from it. The frames in it are
/// not known here, but everything reported as recorded is in the file.
void check_left_by_zeromq(const Outcome& outcome, std::uint64_t left) {
  CHECK((outcome.exit_code == 0 || outcome.exit_code == 1 || outcome.exit_code == 128 + SIGABRT ||
         outcome.exit_code == 128 + SIGSEGV));
  const Json tally = Json::parse(outcome.out, nullptr, false);
  if (tally.is_object()) CHECK(left >= tally["recorded"].get<std::uint64_t>());
}

void check_left(const Outcome& outcome, std::uint64_t left, const TemporaryFolder& folder) {
  CHECK((outcome.exit_code == 0 || outcome.exit_code == 1));
  const Json tally = Json::parse(outcome.out, nullptr, false);
  if (tally.is_object()) CHECK(left >= tally["recorded"].get<std::uint64_t>());
  if (outcome.exit_code == 0) {
    REQUIRE(tally.is_object());
    CHECK(left == stream_frames);
    CHECK(std::filesystem::exists(folder / "run.mcap"));
    CHECK_FALSE(std::filesystem::exists(folder / "run.mcap.partial"));
  } else {
    CHECK((contains(outcome.err, "error") || contains(outcome.err, "MEMORY")));
  }
  if (outcome.exit_code != 0 && !contains(outcome.err, "recording to"))  // the recording was not started
    CHECK_FALSE((std::filesystem::exists(folder / "run.mcap.partial") || std::filesystem::exists(folder / "run.mcap")));
}

void check(const std::vector<std::string>& program, const std::string& call, unsigned long most) {
  const auto run = [&](const Fault& fault, const TemporaryFolder& folder, const TemporaryFolder& elsewhere) {
    std::vector<std::string> words = program;
    for (std::string& word : words)
      if (word.starts_with("FOLDER/")) word = (folder / word.substr(7)).string();
    return record_stream(with(fault, folder.path(), elsewhere / "count"), words, folder);
  };
  unsigned long count = 0;
  {
    const TemporaryFolder folder, elsewhere;
    const Outcome outcome = run({call, 0}, folder, elsewhere);
    REQUIRE_MESSAGE(outcome.exit_code == 0, outcome.err);
    count = counted(elsewhere / "count");
  }
  const std::vector<unsigned long> numbers = chosen(count, most);
  int by_zeromq = 0;
  for (const unsigned long nth : numbers) {
    const TemporaryFolder folder, elsewhere;
    const Outcome outcome = run({call, nth}, folder, elsewhere);
    CAPTURE(call);
    CAPTURE(nth);
    CAPTURE(outcome.exit_code);
    CAPTURE(outcome.err);
    CAPTURE(outcome.out);
    if (was_asked_by_zeromq(program[0], elsewhere / "count")) {
      ++by_zeromq;
      check_left_by_zeromq(outcome, frames_left(folder));
    } else {
      check_left(outcome, frames_left(folder), folder);
    }
  }
  MESSAGE(program[0].substr(program[0].rfind('/') + 1) << ": " << numbers.size() << " of " << count << " calls of "
                                                       << call << " failed, " << by_zeromq << " of them ZeroMQ's own");
}

}  // namespace

TEST_CASE("any call of lbea-record fails") {
  for (const std::string call : {"write", "sync", "rename", "thread", "allocate"})
    check({LBEA_RECORD, "FOLDER/run.mcap", "--results", "ipc:///nobody"}, call, 8);
}

TEST_CASE("any call of lbea-serve --record fails") {
  const TemporaryFolder folder;
  const std::string demo = (data() / "rail-demo").string(), model = (folder / "m.lbea").string();
  REQUIRE(run_program(LBEA_BAKE " --run " + demo + "/runs/run_023 --region-nodes " + demo +
                          "/region-nodes.txt --modes 5 --steps 0,10 -o " + model,
                      folder.path())
              .exit_code == 0);
  const std::vector<std::string> serve{
      LBEA_SERVE, model, "--results", "ipc://" + (folder / "results").string(), "--record", "FOLDER/run.mcap"};
  for (const std::string call : {"write", "sync", "allocate"}) check(serve, call, 5);
  std::vector<std::string> with_everything = serve;
  with_everything.insert(with_everything.end(),
                         {"--preview", "ipc://" + (folder / "preview").string(), "--metrics", "127.0.0.1:0"});
  check(with_everything, "thread", all);
}
