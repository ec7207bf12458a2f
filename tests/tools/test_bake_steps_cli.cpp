// lbea-bake plan, survey, shard, merge, status and lbea-inspect --diff: output and exit codes.
#include "tests/support/refusals.hpp"
#include "tests/tools/bake_program.hpp"

#include <lbea/lbea.hpp>

#include <doctest/doctest.h>
#include <nlohmann/json.hpp>

using namespace lbea;
using namespace lbea::test;

namespace {

const std::string two_steps = " --modes 10 --steps 0,20 ";

/// A run of lbea-bake that succeeds.
Outcome bake_step(const TemporaryFolder& folder, const std::string& arguments) {
  const Outcome outcome = lbea_bake(folder, arguments);
  CAPTURE(arguments);
  CHECK_MESSAGE(outcome.exit_code == 0, outcome.err);
  return outcome;
}

nlohmann::json json_of(const TemporaryFolder& folder, const std::string& arguments) {
  return nlohmann::json::parse(bake_step(folder, arguments + " --json").out);
}

/// A bulge of n x n shells on 50 x 50 mm, as a keyword file.
std::string bulge(int n, int depth) {
  std::string nodes = "*KEYWORD\n*NODE\n", shells = "*ELEMENT_SHELL\n";
  for (int y = 0; y <= n; ++y)
    for (int x = 0; x <= n; ++x) {
      const auto at = [n](int i) { return 50.0 * i / n; };
      const double height = depth * at(x) * (50 - at(x)) * at(y) * (50 - at(y)) / 400'000;
      const int id = 1 + x + y * (n + 1);
      nodes += std::to_string(id) + "," + std::to_string(at(x)) + "," + std::to_string(at(y)) + "," +
               std::to_string(height) + "\n";
      if (x == n || y == n) continue;
      shells += std::to_string(id) + ",1";
      for (const int corner : {id, id + 1, id + n + 2, id + n + 1}) shells += "," + std::to_string(corner);
      shells += "\n";
    }
  return nodes + shells;
}

}  // namespace

TEST_CASE("plan, shards and merge give the same bytes as lbea-bake; status prints their progress") {
  const TemporaryFolder folder;
  bake_step(folder, demo + "/ensemble.toml -o alone.lbea" + two_steps);
  for (const char* index : {"0", "1"})
    bake_step(folder, "survey " + demo + "/ensemble.toml --work work --of 2 --index " + index + two_steps);
  const auto plan = json_of(folder, "plan " + demo + "/ensemble.toml --work work -o steps.lbea" + two_steps);
  CHECK(plan["runs"] == 10);
  CHECK(plan["samples"] == 20);
  CHECK(plan["model_bytes"] == std::filesystem::file_size(folder / "alone.lbea"));
  CHECK(plan["seconds_per_sample"].get<double>() > 0);
  CHECK(json_of(folder, "status --work work")["waiting"] == 10);
  CHECK(contains(bake_step(folder, "shard --work work --index 1 --of 3").out,
                 "3 runs in this shard: 0 were finished, 3 baked, 0 failed"));
  CHECK(json_of(folder, "status --work work")["finished"] == 3);
  const Outcome early = lbea_bake(folder, "merge --work work");
  CHECK(early.exit_code == 1);
  CHECK(contains(early.err, "7 of 10 runs are not baked yet"));
  std::filesystem::create_directory(folder / "elsewhere");  // paths in the plan do not depend on the working folder
  CHECK(
      run_program(std::string(LBEA_BAKE) + " shard --work ../work --index 0 --of 1", folder / "elsewhere").exit_code ==
      0);
  bake_step(folder, "merge --work work");
  CHECK(text_of(folder / "steps.lbea") == text_of(folder / "alone.lbea"));
  double bytes = 0;
  for (const auto& entry : std::filesystem::recursive_directory_iterator(folder / "work"))
    if (entry.is_regular_file()) bytes += static_cast<double>(entry.file_size());
  CHECK(bytes ==
        doctest::Approx(plan["work_bytes"].get<double>() + 5'000 * 10).epsilon(0.02));  // a few kB per run in the plan
}

TEST_CASE("a truncated run is named by plan, status, merge and the model; --diff names a run that was withdrawn") {
  const TemporaryFolder folder;
  std::filesystem::create_directory(folder / "runs");
  for (const char* run : {"run_023", "run_038", "run_045"})
    std::filesystem::copy(data() / "rail-demo/runs" / run, folder / "runs" / run,
                          std::filesystem::copy_options::recursive);
  put(folder / "runs/broken/d3plot", text_of(data() / "rail-demo/runs/run_038/d3plot").substr(0, 5000));
  put(folder / "e.toml", "runs = ['runs/*']\nreference_run = 'run_023'\n");
  bake_step(folder, "plan e.toml --work work -o m.lbea" + two_steps);
  bake_step(folder, "shard --work work --index 0 --of 1");
  const auto status = json_of(folder, "status --work work");
  REQUIRE(status["failed"].size() == 1);
  CHECK(status["failed"][0]["run"] == "broken");
  CHECK(contains(bake_step(folder, "status --work work").out, "broken: "));
  CHECK(contains(bake_step(folder, "merge --work work").out, "left out       broken: "));
  CHECK(contains(std::string(Model::open(folder / "m.lbea").provenance()), "\"left_out\":[\"broken\"]"));

  const Outcome plain = lbea_bake(folder, "e.toml -o plain.lbea" + two_steps);
  CHECK(plain.exit_code == 1);
  bake_step(folder, "e.toml -o plain.lbea --leave-out-broken" + two_steps);
  CHECK(text_of(folder / "plain.lbea") == text_of(folder / "m.lbea"));

  put(folder / "e.toml", "runs = ['runs/*']\nexclude = ['broken', 'run_038']\nreference_run = 'run_023'\n");
  bake_step(folder, "plan e.toml --work work -o fewer.lbea" + two_steps);
  bake_step(folder, "shard --work work --index 0 --of 1");
  bake_step(folder, "merge --work work");
  const Outcome same = run_program(std::string(LBEA_INSPECT) + " m.lbea --diff m.lbea", folder.path());
  CHECK(contains(same.out, "hold the same"));
  const Outcome outcome = run_program(std::string(LBEA_INSPECT) + " m.lbea --diff fewer.lbea --json", folder.path());
  const auto diff = nlohmann::json::parse(outcome.out);
  CHECK(diff["runs"]["withdrawn"] == nlohmann::json{"run_038"});
  CHECK(diff["runs"]["added"].empty());
  CHECK(diff["runs"]["changed"].empty());
  CHECK(diff["settings"]["left_out"]["after"].is_null());
  CHECK_FALSE(diff["same"].get<bool>());
  const Outcome back = run_program(std::string(LBEA_INSPECT) + " fewer.lbea --diff m.lbea", folder.path());
  CHECK(contains(back.out, "run      added      run_038"));
}

TEST_CASE("a shard with a failed run has its own exit code and finishes the others; --verify repairs damage") {
  const TemporaryFolder folder;
  std::filesystem::create_directory(folder / "runs");
  for (const char* run : {"run_023", "run_038", "run_045"})
    std::filesystem::copy(data() / "rail-demo/runs" / run, folder / "runs" / run,
                          std::filesystem::copy_options::recursive);
  put(folder / "e.toml", "runs = ['runs/*']\n");
  bake_step(folder, "plan e.toml --work work -o m.lbea" + two_steps);
  const std::string whole = text_of(folder / "runs/run_038/d3plot");
  put(folder / "runs/run_038/d3plot", whole.substr(0, 5000));
  const Outcome shard = lbea_bake(folder, "shard --work work --index 0 --of 1");
  CHECK(shard.exit_code == 3);
  CHECK(contains(shard.out, "3 runs in this shard: 0 were finished, 2 baked, 1 failed"));
  CHECK(json_of(folder, "status --work work")["finished"] == 2);
  CHECK(json_of(folder, "status --work work")["failed"][0]["run"] == "run_038");
  CHECK(lbea_bake(folder, "shard --work work --index 0 --of 1").exit_code == 3);
  CHECK(contains(bake_step(folder, "merge --work work").out, "left out       run_038: "));

  put(folder / "runs/run_038/d3plot",
      whole);  // copied again after the plan, therefore another file until the next plan
  bake_step(folder, "plan e.toml --work work -o m.lbea" + two_steps);
  bake_step(folder, "shard --work work --index 0 --of 1");
  const auto record = std::filesystem::directory_iterator(folder / "work/record")->path();
  std::string bytes = text_of(record);
  bytes[bytes.size() / 2] = static_cast<char>(bytes[bytes.size() / 2] ^ 1);
  put(record, bytes);
  CHECK(contains(bake_step(folder, "shard --work work --index 0 --of 1 --verify").out, "2 were finished, 1 baked"));
  bake_step(folder, "merge --work work");
  bake_step(folder, "e.toml -o alone.lbea" + two_steps);
  CHECK(text_of(folder / "m.lbea") == text_of(folder / "alone.lbea"));
}

TEST_CASE("runs are added to a model and withdrawn from it without reading the runs in it") {
  const TemporaryFolder folder;
  std::filesystem::create_directory(folder / "runs");
  for (const char* run : {"run_023", "run_038", "run_045", "run_052"})
    std::filesystem::copy(data() / "rail-demo/runs" / run, folder / "runs" / run,
                          std::filesystem::copy_options::recursive);
  const auto toml = [&](const char* name, const std::string& exclude) {
    put(folder / name, "runs = ['runs/*']\nexclude = [" + exclude +
                           "]\nreference_run = 'run_023'\ntime_unit = 'ms'\nviews = '" + demo + "/sensor.json'\n");
  };
  toml("three.toml", "'run_052'");
  toml("all.toml", "");
  toml("fewer.toml", "'run_045'");
  bake_step(folder, "three.toml -o three.lbea" + two_steps);
  bake_step(folder, "all.toml -o all.lbea" + two_steps);
  bake_step(folder, "fewer.toml -o fewer.lbea" + two_steps);

  // The second half of these files is not read again.
  for (const char* run : {"run_038", "run_045"})
    for (const auto& entry : std::filesystem::directory_iterator(folder / "runs" / run)) {
      std::string bytes = text_of(entry.path());
      if (bytes.size() > 100'000)
        std::fill(bytes.begin() + static_cast<std::ptrdiff_t>(bytes.size() / 2), bytes.end(), '\x7f');
      put(entry.path(), bytes);
    }
  bake_step(folder, "all.toml --from three.lbea -o added.lbea" + two_steps);
  CHECK(text_of(folder / "added.lbea") == text_of(folder / "all.lbea"));
  bake_step(folder, "plan fewer.toml --from added.lbea --work work -o withdrawn.lbea" + two_steps);
  bake_step(folder, "shard --work work --index 0 --of 1");
  bake_step(folder, "merge --work work");
  CHECK(text_of(folder / "withdrawn.lbea") == text_of(folder / "fewer.lbea"));

  const Outcome other = lbea_bake(folder, "all.toml --from three.lbea -o x.lbea --modes 10 --steps 0,10");
  CHECK(other.exit_code == 1);
  CHECK(contains(other.err, "does not hold state 10"));
  const Outcome unit = lbea_bake(folder, "all.toml --from three.lbea -o x.lbea --time-factor 1" + two_steps);
  CHECK(contains(unit.err, "another unit"));
}

TEST_CASE("runs with other meshes are mapped again, not taken from a model") {
  const TemporaryFolder folder;
  put(folder / "a.k", bulge(6, 1));
  put(folder / "b.k", bulge(6, 2));
  put(folder / "other.k", bulge(9, 1));
  const std::string ensemble = "runs = ['*.k']\nfields = []\nmodes = 10\n";
  put(folder / "e.toml", ensemble);
  put(folder / "near.toml", ensemble + "mapping.distance = 0.001\n");
  const auto first = json_of(folder, "e.toml -o first.lbea");
  REQUIRE(first["mapped"].size() == 1);
  CHECK(json_of(folder, "e.toml --from first.lbea -o again.lbea")["mapped"] == first["mapped"]);
  CHECK(text_of(folder / "again.lbea") == text_of(folder / "first.lbea"));
  const std::string text = bake_step(folder, "e.toml -o first.lbea").out;
  CHECK(contains(text, "mapped         other.k: 36 of 36 elements onto 81 of another mesh; nodes 0.0046 mm off"));
  CHECK(contains(text, "at element 5, after a smooth difference of 0.01"));
  // Onto the other mesh, the runs are mapped from their own ones.
  put(folder / "onto.toml", ensemble + "reference_run = 'other.k'\n");
  CHECK(json_of(folder, "onto.toml --from first.lbea -o onto.lbea")["mapped"].size() == 2);
  CHECK(Model::open(folder / "onto.lbea").elements() == 81);
  const Outcome near = lbea_bake(folder, "near.toml --from first.lbea -o x.lbea");
  CHECK(near.exit_code == 1);
  CHECK(contains(near.err, "run other.k: its mesh of 81 elements is another one"));
}

TEST_CASE("fields in 16 bits: reported by bake and inspect, kept by --from, not converted back") {
  const TemporaryFolder folder;
  put(folder / "e.toml", "runs = ['" + demo + "/runs/run_0[234]*']\ntime_unit = 'ms'\ncompact_fields = true\n");
  const std::string two = " --run " + demo + "/runs/run_023 --run " + demo + "/runs/run_038 --time-factor 0.001";
  const auto summary = json_of(folder, "e.toml -o compact.lbea" + two_steps);
  const double error = summary["rounded_fields"][0]["largest_error"];
  CHECK(error > 0);
  CHECK(error < 1e-4);  // plastic strain, of 1 or so: 2 / 65,533 / 2
  const Outcome shown = run_program(std::string(LBEA_INSPECT) + " compact.lbea --json", folder.path());
  CHECK(nlohmann::json::parse(shown.out)["fields"][0]["largest_error"] == error);
  CHECK(nlohmann::json::parse(shown.out)["fields"][0]["bits"] == 16);
  CHECK(contains(bake_step(folder, "e.toml -o wide.lbea --compact-fields false" + two_steps).out, "1 fields"));
  CHECK(contains(bake_step(folder, "e.toml -o again.lbea" + two_steps).out, "plastic_strain [1] in 16 bits, within "));
  CHECK(text_of(folder / "again.lbea") == text_of(folder / "compact.lbea"));
  bake_step(folder, "plan e.toml --work work -o shards.lbea" + two_steps);
  bake_step(folder, "shard --work work --index 0 --of 1");
  bake_step(folder, "merge --work work");
  CHECK(text_of(folder / "shards.lbea") == text_of(folder / "compact.lbea"));

  // Adding runs to a model in 16 or 32 bits gives the same bytes as reading all runs.
  for (const char* bits : {"true", "false"}) {
    bake_step(folder, two + " --compact-fields " + bits + " -o two.lbea" + two_steps);
    bake_step(folder, "e.toml --from two.lbea -o grown.lbea" + two_steps);
    CHECK(text_of(folder / "grown.lbea") == text_of(folder / "compact.lbea"));
  }
  const Outcome back = lbea_bake(folder, "e.toml --compact-fields false --from compact.lbea -o x.lbea" + two_steps);
  CHECK(back.exit_code == 1);
  CHECK(contains(back.err, "compact.lbea has its fields in 16 bits"));
}

TEST_CASE("wrong steps are refused with a message") {
  const TemporaryFolder folder;
  const auto refused = [&](const std::string& arguments, int exit_code, const std::string& words) {
    const Outcome outcome = lbea_bake(folder, arguments);
    CAPTURE(arguments);
    CHECK(outcome.exit_code == exit_code);
    CHECK_MESSAGE(contains(outcome.err, words), outcome.err);
  };
  refused("shard --work none --index 0 --of 1", 1, "none holds no plan");
  refused("status --work none", 1, "none holds no plan");
  refused("merge", 2, "--work");
  refused("shard --work none --index 0", 2, "--of");
  refused("plan --work work", 2, "name an ensemble.toml");
}
