// Every write, fsync, rename, reservation and allocation of a bake, a recovery, a replay and a report fails once. A
// failed program reports the reason and leaves no file; a successful one leaves its usual files.
#include "tests/faults/faults.hpp"
#include "tests/faults/recordings.hpp"

using namespace lbea;
using namespace lbea::mcap;
using namespace lbea::wire;
using namespace lbea::test;

namespace {

const std::string demo = (data() / "rail-demo").string();
const std::vector<std::string> calls{"write", "sync", "rename", "truncate", "allocate"};
constexpr unsigned long most_calls = 15;

std::string bake_command(const std::string& output) {
  return LBEA_BAKE " --run " + demo + "/runs/run_023 --region-nodes " + demo +
         "/region-nodes.txt --modes 5 --steps 0,10 --threads 1 -o " + output;
}

}  // namespace

TEST_CASE("any call of a bake fails") {
  for (const std::string& call : calls)
    OneFile{bake_command("m.lbea"), "m.lbea"}.check(call, most_calls, call == "allocate" ? 1000 : all);
}

TEST_CASE("any allocation of a small bake fails: all of them, in a long run") {
  const std::string run = (data() / "fuzz" / "d3plot" / "rich").string();
  OneFile{LBEA_BAKE " --run " + run + " --modes 2 --threads 1 -o m.lbea", "m.lbea"}.check("allocate", most_calls);
}

TEST_CASE("any call of a recovery fails") {
  const TemporaryFolder folder;
  const auto damaged = put_damaged_recording(folder / "run.mcap.partial");
  for (const std::string& call : calls)
    OneFile{LBEA_INSPECT " --recover " + damaged.string() + " -o fixed.mcap", "fixed.mcap"}.check(call, most_calls);
}

TEST_CASE("any call of a replay into a model fails") {
  const TemporaryFolder folder;
  REQUIRE(run_program(bake_command("m.lbea"), folder.path()).exit_code == 0);
  const auto recording = put_recording(folder / "run.mcap");
  const std::string command =
      LBEA_REPLAY " " + recording.string() + " --model " + (folder / "m.lbea").string() + " -o results.mcap";
  for (const std::string& call : calls) OneFile{command, "results.mcap"}.check(call, most_calls);
}

TEST_CASE("any call of a report fails") {
  const TemporaryFolder folder;
  REQUIRE(run_program(bake_command("m.lbea"), folder.path()).exit_code == 0);
  const auto recording = put_recording(folder / "run.mcap");
  const std::string command =
      LBEA_REPORT " " + recording.string() + " --model " + (folder / "m.lbea").string() + " --no-pose -o report.html";
  for (const std::string& call : calls) OneFile{command, "report.html"}.check(call, most_calls);
}

TEST_CASE("a program that hangs is killed, and the test reports it") {
  const TemporaryFolder folder;
  const Outcome outcome = run_program("sleep 600", folder.path(), {}, std::chrono::milliseconds(100));
  CHECK(outcome.exit_code == 128 + SIGKILL);
  CHECK(outcome.err == "killed, because it still ran after 100 ms\n");
}

TEST_CASE("any thread of a bake and of a replay cannot be started: all of them, in a long run") {
  constexpr unsigned long most_threads = 30;
  const TemporaryFolder folder;
  REQUIRE(run_program(bake_command("m.lbea"), folder.path()).exit_code == 0);
  const auto recording = put_recording(folder / "run.mcap");
  // Three states of each run: nearly as many threads as with all, in a fifth of the time.
  OneFile{LBEA_BAKE " " + demo + "/ensemble.toml --modes 5 --steps 0,6,12 --threads 3 -o m.lbea", "m.lbea"}.check(
      "thread", most_threads);
  OneFile{LBEA_REPLAY " " + recording.string() + " --model " + (folder / "m.lbea").string() +
              " --threads 4 -o results.mcap",
          "results.mcap"}
      .check("thread", most_threads);
}

TEST_CASE("files that cannot be mapped are named") {
  const TemporaryFolder folder, elsewhere;
  REQUIRE(run_program(bake_command("m.lbea"), folder.path()).exit_code == 0);
  const OneFile inspect{LBEA_INSPECT " m.lbea", "m.lbea"};
  REQUIRE(inspect.run({"map", 0}, folder, elsewhere / "count").exit_code == 0);
  REQUIRE(counted(elsewhere / "count") > 0);
  const Outcome outcome = inspect.run({"map", 1}, folder, elsewhere / "count");
  CHECK(outcome.exit_code == 1);
  CHECK(contains(outcome.err, "m.lbea"));
}

TEST_CASE("results that cannot be printed are a failure") {
  const TemporaryFolder folder;
  REQUIRE(run_program(bake_command("m.lbea"), folder.path()).exit_code == 0);
  const Outcome outcome = run_program("sh -c '" LBEA_INSPECT " m.lbea >/dev/full'", folder.path());
  CHECK(outcome.exit_code == 1);
  CHECK(contains(outcome.err, "cannot write to standard output: No space left on device"));
}

TEST_CASE("the next bake removes the files of a killed one, but not those of a running bake or other files") {
  const TemporaryFolder folder;
  pid_t gone = 0;
  {
    Process killed({"/bin/sh", "-c", "echo $$ >" + (folder / "pid").string() + "; kill -9 $$"}, folder / "out",
                   folder / "err");
    CHECK(killed.wait() == 128 + SIGKILL);
    gone = std::stoi(text_of(folder / "pid"));
  }
  const std::string dead = std::to_string(gone), living = std::to_string(::getpid());
  for (const std::string& stays : {"m.lbea.tmp-" + living + "-0", "m.lbea.tmp-" + dead + "-0x", "m.lbea.tmp-" + dead,
                                   "other.lbea.tmp-" + dead + "-0", std::string("m.lbea.tmp-notes"),
                                   "m.lbea.tmp-work-" + living + "-0/plan/plan", std::string("elsewhere/file")})
    put(folder / stays, "mine");
  const std::size_t before = files_in(folder.path());
  put(folder / ("m.lbea.tmp-" + dead + "-0"), "half a model");
  put(folder / ("m.lbea.tmp-work-" + dead + "-1/plan/plan"), "half a plan");
  for (int i = 0; i < 300; ++i)
    put(folder / ("m.lbea.tmp-work-" + dead + "-1/record/a-record-with-a-long-name-" + std::to_string(i)), "");
  std::filesystem::create_directory_symlink(folder / "elsewhere", folder / ("m.lbea.tmp-work-" + dead + "-1/link"));
  const Outcome outcome = run_program(bake_command("m.lbea"), folder.path());
  CHECK_MESSAGE(outcome.exit_code == 0, outcome.err);
  CHECK(files_in(folder.path()) == before + 1);  // the model
  CHECK(text_of(folder / "elsewhere/file") == "mine");
}

TEST_CASE("killed at any time and restarted: the same bytes of the bake, and no other file") {
  const TemporaryFolder undisturbed, folder;
  REQUIRE(run_program(bake_command("m.lbea"), undisturbed.path()).exit_code == 0);
  std::mt19937 random(5);
  const int kills = is_long_run() ? 300 : 8;
  int remains = 0;
  for (int i = 0; i < kills; ++i) {
    Process bake({"/bin/sh", "-c", "cd '" + folder.path().string() + "' && exec " + bake_command("m.lbea")},
                 undisturbed / "out", undisturbed / "err");
    std::this_thread::sleep_for(std::chrono::microseconds(random() % 60'000));
    bake.signal(SIGKILL);
    static_cast<void>(bake.wait());
    remains += files_in(folder.path()) > (std::filesystem::exists(folder / "m.lbea") ? 1u : 0u) ? 1 : 0;
    if (std::filesystem::exists(folder / "m.lbea"))
      CHECK((text_of(folder / "m.lbea") == text_of(undisturbed / "m.lbea")));
  }
  MESSAGE(kills << " bakes killed, " << remains << " times something was left");
  REQUIRE(run_program(bake_command("m.lbea"), folder.path()).exit_code == 0);
  CHECK((text_of(folder / "m.lbea") == text_of(undisturbed / "m.lbea")));
  CHECK(files_in(folder.path()) == 1);
}
