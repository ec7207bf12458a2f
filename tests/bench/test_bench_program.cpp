// lbea-bench as the program it is, on the demo's model and frames.
#include "adapters/file/atomic_file.hpp"
#include "tests/support/test_data.hpp"

#include <doctest/doctest.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <cstdlib>
#include <fstream>
#include <string>

#include <sys/wait.h>

using namespace lbea;

namespace {

const std::filesystem::path demo = LBEA_DEMO;
const std::string model = (demo / "rail.lbea").string(), frames = (demo / "frames").string();
const std::string pose = " --pose " + (test::data() / "rail-demo" / "sensor.json").string();

struct Outcome {
  int code;
  std::string out, err;
};

std::string text_of(const std::filesystem::path& file) { return std::string(as_text(read_file(file))); }

Outcome bench(const std::string& arguments) {
  const test::TemporaryFolder folder;
  const std::string command =
      std::string(LBEA_BENCH) + " " + arguments + " >" + (folder / "out").string() + " 2>" + (folder / "err").string();
  const int status = std::system(command.c_str());
  REQUIRE(WIFEXITED(status));
  return {WEXITSTATUS(status), text_of(folder / "out"), text_of(folder / "err")};
}

bool contains(const std::string& text, const std::string& part) { return text.find(part) != std::string::npos; }

}  // namespace

TEST_CASE("the demo's frames: answers agree, product and baselines are timed, every frame is in the table") {
  const test::TemporaryFolder folder;
  const std::string csv = (folder / "times.csv").string();
  const Outcome run =
      bench(model + " " + frames + pose + " --frames 50 --warm-up 5 --baseline nanoflann,portable --json --csv " + csv);
  REQUIRE(run.code == 0);
  const nlohmann::json report = nlohmann::json::parse(run.out);
  CHECK(contains(report["facts"]["checked"], "answers agree with double precision on all 21 clouds"));
  REQUIRE(report["pipelines"].size() == 3);
  for (const auto& pipeline : report["pipelines"]) {
    CHECK(pipeline["frames"] == 50);
    const auto& total = pipeline["stages_us"]["total"];
    CHECK(total["p50"] <= total["p90"]);
    CHECK(total["p99"] <= total["max"]);
    CHECK(total["p50"] > 0);
  }
  const std::string table = text_of(csv);
  CHECK(std::ranges::count(table, '\n') == 1 + 3 * 50);
  CHECK(table.starts_with("pipeline,frame,cloud,points,index_ns,"));
}

TEST_CASE("thinned clouds, Markdown, another method") {
  const Outcome run =
      bench(model + " " + frames + pose + " --frames 5 --points 1000 --method vtp --kernels baseline --markdown");
  CHECK(run.code == 0);
  CHECK(contains(run.out, "- checked: the answers agree"));
  CHECK(contains(run.out, "| lbea, baseline | total |"));
  CHECK(contains(run.out, "of 1000 to 1000 points"));
}

TEST_CASE("a damaged model is refused") {
  const test::TemporaryFolder folder;
  std::string bytes = text_of(model);
  bytes[bytes.size() / 2] ^= 1;
  std::ofstream(folder / "damaged.lbea", std::ios::binary) << bytes;
  const Outcome run = bench((folder / "damaged.lbea").string() + " " + frames + pose);
  CHECK(run.code == 1);
  CHECK(contains(run.err, "damaged.lbea"));
  CHECK(run.out == "");
}

TEST_CASE("clouds that the model has nothing to do with are not timed") {
  const Outcome run = bench(model + " " + frames + " --frames 5");  // in sensor coordinates
  CHECK(run.code == 1);
  CHECK(contains(run.err, "--pose"));
  CHECK(run.out == "");
}

TEST_CASE("wrong usage") {
  CHECK(bench("").code == 2);
  CHECK(bench(model).code == 2);
  CHECK(bench(model + " " + frames + " --frames 0").code == 2);
  CHECK(bench(model + " " + frames + " --baseline abacus").code == 2);
  CHECK(bench(model + " " + frames + " --json --markdown").code == 2);
  CHECK(bench("--help").code == 0);
  const Outcome kernels = bench(model + " " + frames + pose + " --kernels abacus");
  CHECK(kernels.code == 1);
  CHECK(contains(kernels.err, "baseline"));
}
