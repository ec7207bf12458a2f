// lbea-bench on the model and the frames of the demo.
#include "tests/support/files.hpp"
#include "tests/support/program.hpp"
#include "tests/support/refusals.hpp"
#include "tests/support/test_data.hpp"

#include <doctest/doctest.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <csignal>
#include <string>

using namespace lbea::test;

namespace {

const std::filesystem::path demo = LBEA_DEMO;
const std::string model = (demo / "rail.lbea").string(), frames = (demo / "frames").string();
const std::string pose_file = (data() / "rail-demo" / "sensor.json").string(), pose = " --pose " + pose_file;

Outcome bench(const std::string& arguments) {
  const TemporaryFolder folder;
  return run_program(std::string(LBEA_BENCH) + " " + arguments, folder.path());
}

}  // namespace

TEST_CASE("the demo's frames: answers agree, product and baselines are timed, the table has every frame") {
  const TemporaryFolder folder;
  const std::string csv = (folder / "times.csv").string();
  const Outcome run =
      bench(model + " " + frames + pose + " --frames 50 --warm-up 5 --baseline nanoflann,portable --json --csv " + csv);
  REQUIRE(run.exit_code == 0);
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
  CHECK(run.exit_code == 0);
  CHECK(contains(run.out, "- checked: the answers agree"));
  CHECK(contains(run.out, "| lbea, baseline | total |"));
  CHECK(contains(run.out, "of 1000 to 1000 points"));
}

TEST_CASE("clouds made to be slow, of as many points as requested") {
  const Outcome run = bench(model + " " + frames + pose + " --adversarial --points 4000 --frames 9 --method fit");
  CHECK(run.exit_code == 0);
  CHECK(contains(run.out, "a ring of radius 0.03 about x"));
}

TEST_CASE("method fit: its stages beside method lbea and plain loops, tracked, with inference") {
  const std::string fit = model + " " + frames + pose + " --method fit --frames 30 --warm-up 2 --json";
  const Outcome run = bench(fit + " --baseline lbea,nanoflann --track --infer plastic_strain");
  REQUIRE(run.exit_code == 0);
  const nlohmann::json report = nlohmann::json::parse(run.out);
  CHECK(contains(report["facts"]["checked"], "the answers agree with double precision on all 21 clouds"));
  REQUIRE(report["pipelines"].size() == 3);
  CHECK(report["pipelines"][0]["pipeline"] == "fit");
  const auto has = [&](std::size_t pipeline, const char* stage) {
    return report["pipelines"][pipeline]["stages_us"].contains(stage);
  };
  for (const char* stage : {"image", "ranking", "estimate", "judgment", "coverage", "track", "infer"}) {
    CHECK(has(0, stage));
    CHECK_FALSE((has(1, stage) && std::string(stage) != "coverage"));
  }
  CHECK(has(2, "ranking"));
  CHECK_FALSE(has(2, "estimate"));
  const Outcome refused = bench(fit + " --baseline portable");
  CHECK(refused.exit_code == 1);
  CHECK(contains(refused.err, "leave out --kernels and the baseline portable"));
  CHECK(contains(bench(fit + " --infer warmth").err, "plastic_strain"));
  CHECK(contains(bench(model + " " + frames + pose + " --track").err, "need --method fit"));
}

TEST_CASE("a damaged model is refused") {
  const TemporaryFolder folder;
  std::string bytes = text_of(model);
  bytes[bytes.size() / 2] ^= 1;
  const Outcome run = bench(put(folder / "damaged.lbea", bytes).string() + " " + frames + pose);
  CHECK(run.exit_code == 1);
  CHECK(contains(run.err, "damaged.lbea"));
  CHECK(run.out == "");
}

TEST_CASE("clouds without points in the envelope are not timed") {
  const Outcome run = bench(model + " " + frames + " --frames 5");  // in sensor coordinates
  CHECK(run.exit_code == 1);
  CHECK(contains(run.err, "--pose"));
  CHECK(run.out == "");
}

TEST_CASE("times through a running server; without one, an error") {
  const TemporaryFolder folder;
  const std::string endpoints = "ipc://" + (folder / "frames").string() + ",ipc://" + (folder / "results").string();
  const Outcome alone = bench(model + " " + frames + pose + " --through " + endpoints);
  CHECK(alone.exit_code == 1);
  CHECK(contains(alone.err, "start lbea-serve"));
  CHECK(bench(model + " " + frames + pose + " --through ipc:///frames").exit_code == 1);
  const auto comma = endpoints.find(',');
  Process server({LBEA_SERVE, model, "--frames", endpoints.substr(0, comma), "--results", endpoints.substr(comma + 1),
                  "--pose", pose_file},
                 (folder / "out").string(), (folder / "err").string());
  const Outcome timed = bench(model + " " + frames + pose + " --frames 20 --warm-up 2 --json --through " + endpoints);
  CHECK(timed.exit_code == 0);
  const auto report = nlohmann::json::parse(timed.out);
  CHECK(report["frames"] == 20);
  CHECK(report["p50_us"] > 0);
  CHECK(report["p50_us"] <= report["max_us"]);
  // At a rate that the server keeps under the sanitizers on a busy machine, too: otherwise frames are lost.
  const Outcome at_rate =
      bench(model + " " + frames + pose + " --frames 20 --warm-up 2 --rate 5 --json --through " + endpoints);
  CHECK(at_rate.exit_code == 0);
  const auto run = nlohmann::json::parse(at_rate.out);
  CHECK(run["sent"] == 20);
  CHECK(run["matched"] == 20);
  CHECK(run["refused"] == 0);
  CHECK(run["lost"] == 0);
  CHECK(run["seconds"] >= 19.0 / 5);  // nothing is sent before it is due
  std::size_t counted = 0;
  for (const auto& bucket : run["histogram"]) counted += bucket["frames"].get<std::size_t>();
  CHECK(counted == 20);
  server.signal(SIGINT);
  CHECK(server.wait() == 0);
}

TEST_CASE("wrong usage") {
  CHECK(bench("").exit_code == 2);
  CHECK(bench(model).exit_code == 2);
  CHECK(bench(model + " " + frames + " --frames 0").exit_code == 2);
  CHECK(bench(model + " " + frames + " --baseline abacus").exit_code == 2);
  CHECK(bench(model + " " + frames + " --rate 100").exit_code == 2);
  CHECK(bench(model + " " + frames + " --json --markdown").exit_code == 2);
  CHECK(bench("--help").exit_code == 0);
  const Outcome kernels = bench(model + " " + frames + pose + " --kernels abacus");
  CHECK(kernels.exit_code == 1);
  CHECK(contains(kernels.err, "baseline"));
}
