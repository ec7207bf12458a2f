// lbea-bake: command line, output and exit codes.
#include "tests/support/files.hpp"
#include "tests/support/refusals.hpp"
#include "tests/tools/bake_program.hpp"
#include "tests/tools/opposite_rig.hpp"

#include <lbea/lbea.hpp>

#include <doctest/doctest.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <chrono>

using namespace lbea;
using namespace lbea::test;
using namespace std::chrono_literals;

namespace {

const std::string three_steps = " --modes 10 --steps 0,10,20 ";  // fast

void check_refused(const std::string& arguments, int exit_code, const std::string& words) {
  CAPTURE(arguments);
  const TemporaryFolder folder;
  const Outcome outcome = lbea_bake(folder, arguments);
  CHECK(outcome.exit_code == exit_code);
  CHECK_MESSAGE(contains(outcome.err, words), outcome.err);
  CHECK(outcome.out.empty());
  CHECK(std::filesystem::is_empty(folder.path()));
}

/// A square plate of 6 x 6 nodes, pressed in by `depth` and moved along x, as an OBJ file.
std::string plate(double depth, double moved = 0) {
  std::string text;
  for (int y = 0; y < 6; ++y)
    for (int x = 0; x < 6; ++x) {
      const double dent = x * (5 - x) * y * (5 - y) / 36.0;
      text += "v " + std::to_string(10 * x + moved) + " " + std::to_string(10 * y) + " " +
              std::to_string(-depth * dent) + "\n";
    }
  for (int cell = 0; cell < 25; ++cell) {
    const int corner = 1 + cell % 5 + 6 * (cell / 5);
    for (const int node : {corner, corner + 1, corner + 7, corner + 6})
      text += (node == corner ? "f " : " ") + std::to_string(node);
    text += "\n";
  }
  return text;
}

/// A block of 3 x 3 x 3 cubes as a VTK file; one of the cubes may be eroded.
std::string block(int eroded) {
  std::string text = "# vtk DataFile Version 3.0\nblock\nASCII\nDATASET UNSTRUCTURED_GRID\nPOINTS 64 float\n";
  const auto node = [](int x, int y, int z) { return std::to_string(x + 4 * y + 16 * z) + " "; };
  for (int i = 0; i < 64; ++i)
    text += std::to_string(i % 4) + " " + std::to_string(i / 4 % 4) + " " + std::to_string(i / 16) + "\n";
  text += "CELLS 27 243\n";
  for (int i = 0; i < 27; ++i) {
    const int x = i % 3, y = i / 3 % 3, z = i / 9;
    text += "8 ";
    for (const int up : {0, 1})
      text += node(x, y, z + up) + node(x + 1, y, z + up) + node(x + 1, y + 1, z + up) + node(x, y + 1, z + up);
    text += "\n";
  }
  text += "CELL_TYPES 27\n";
  for (int i = 0; i < 27; ++i) text += "12\n";
  text += "CELL_DATA 27\nSCALARS EROSION_STATUS float 1\nLOOKUP_TABLE default\n";
  for (int i = 0; i < 27; ++i) text += i == eroded ? "0\n" : "1\n";
  return text;
}

}  // namespace

TEST_CASE("runs whose rigid motion is removed: in one process, in shards, and from an earlier model") {
  const TemporaryFolder folder;
  for (const int run : {1, 2, 3})
    for (const int state : {1, 2, 3})
      put(folder / std::to_string(run) / ("B" + std::to_string(state) + ".obj"),
          plate(0.1 * run * (state - 1), 20.0 * run * (state - 1)));
  const std::string common = "time_unit = 'ms'\nfields = []\nmodes = 10\nrigid = 'fit'\n";
  put(folder / "two.toml", "runs = ['1', '2']\n" + common);
  put(folder / "three.toml", "runs = ['1', '2', '3']\n" + common);
  put(folder / "raw.toml", "runs = ['1', '2', '3']\ntime_unit = 'ms'\nfields = []\nmodes = 10\n");
  const Outcome baked = lbea_bake(folder, "three.toml -o three.lbea --json");
  REQUIRE_MESSAGE(baked.exit_code == 0, baked.err);
  const auto channels = nlohmann::json::parse(baked.out)["channels"];
  REQUIRE(channels.size() == 4);
  CHECK(channels[0]["name"] == "rigid_x");
  const Model model = Model::open(folder / "three.lbea");
  for (std::uint32_t s = 0; s < model.samples(); ++s)
    for (std::size_t i = 0; i < model.node_positions(s).size(); i += 3)
      CHECK(std::abs(model.node_positions(s)[i] - model.node_positions(0)[i]) < 0.01f);  // travelled up to 120

  CHECK(lbea_bake(folder, "plan three.toml --work work -o shards.lbea").exit_code == 0);
  CHECK(lbea_bake(folder, "shard --work work --index 1 --of 2").exit_code == 0);
  CHECK(lbea_bake(folder, "shard --work work --index 0 --of 2").exit_code == 0);
  CHECK(lbea_bake(folder, "merge --work work").exit_code == 0);
  CHECK(text_of(folder / "shards.lbea") == text_of(folder / "three.lbea"));

  CHECK(lbea_bake(folder, "two.toml -o two.lbea").exit_code == 0);
  CHECK(lbea_bake(folder, "three.toml --from two.lbea -o from.lbea").exit_code == 0);
  CHECK(text_of(folder / "from.lbea") == text_of(folder / "three.lbea"));
  const Outcome mixed = lbea_bake(folder, "raw.toml --from two.lbea -o mixed.lbea");
  CHECK(mixed.exit_code == 1);
  CHECK_MESSAGE(contains(mixed.err, "was baked with `rigid`"), mixed.err);
  CHECK_FALSE(std::filesystem::exists(folder / "mixed.lbea"));
}

TEST_CASE("the faces of a solid that erodes were left out without a word, and none of those behind it was added") {
  const TemporaryFolder folder;
  constexpr int middle_of_a_side = 4, corner = 26;
  put(folder / "whole/B1.vtk", block(-1));  // the reference run erodes nothing itself
  put(folder / "whole/B2.vtk", block(-1));
  put(folder / "eroding/B1.vtk", block(-1));
  put(folder / "eroding/B2.vtk", block(middle_of_a_side));
  put(folder / "e.toml", "runs = ['whole', 'eroding']\nfields = []\nmodes = 10\n");
  const auto json = nlohmann::json::parse(lbea_bake(folder, "e.toml -o m.lbea --json").out);
  CHECK(json["surface"] == nlohmann::json{{"elements", 54},
                                          {"nodes", 56},
                                          {"eroded", 0},
                                          {"missing", 0},
                                          {"eroding", 1},
                                          {"nodes_left_out", 0},
                                          {"exposed", 5},
                                          {"eroding_runs", {"eroding"}}});
  CHECK(Model::open(folder / "m.lbea").elements() == 54 + 5);
  CHECK(Model::open(folder / "m.lbea").nodes() == 60);     // four of them are inside
  CHECK(Model::open(folder / "m.lbea").vertices() == 56);  // those of the reference mesh's surface
  for (const auto& warning : json["warnings"])             // regression: faces inside of solids counted as missing
    CHECK_FALSE(contains(warning.get<std::string>(), "elements exist in all runs"));
  const auto inspected = nlohmann::json::parse(run_program(LBEA_INSPECT " m.lbea --json", folder.path()).out);
  CHECK(inspected["sizes"]["elements_some_samples_lack"] == 6);
  CHECK(inspected["sizes"]["samples_lacking_elements"] == 4);  // three lack the faces inside, one the outer one

  put(folder / "second/B1.vtk", block(-1));
  put(folder / "second/B2.vtk", block(middle_of_a_side));
  put(folder / "two.toml", "runs = ['whole', 'eroding', 'second']\nfields = []\nmodes = 10\n");
  CHECK(lbea_bake(folder, "two.toml -o full.lbea").exit_code == 0);
  const Outcome from = lbea_bake(folder, "two.toml --from m.lbea -o from.lbea");
  CHECK_MESSAGE(from.exit_code == 0, from.err);
  CHECK(text_of(folder / "from.lbea") == text_of(folder / "full.lbea"));

  // A model without the faces that a new run exposes.
  put(folder / "plain/B1.vtk", block(-1));
  put(folder / "plain/B2.vtk", block(-1));
  put(folder / "old.toml", "runs = ['whole', 'plain']\nfields = []\nmodes = 10\n");
  put(folder / "new.toml", "runs = ['whole', 'plain', 'eroding']\nfields = []\nmodes = 10\n");
  CHECK(lbea_bake(folder, "old.toml -o old.lbea").exit_code == 0);
  CHECK(lbea_bake(folder, "new.toml -o new.lbea").exit_code == 0);
  const Outcome more = lbea_bake(folder, "new.toml --from old.lbea -o more.lbea");
  CHECK_MESSAGE(more.exit_code == 0, more.err);
  CHECK(contains(more.out + more.err, "the earlier model lacks elements"));
  CHECK(text_of(folder / "more.lbea") == text_of(folder / "new.lbea"));
  CHECK(lbea_bake(folder, "survey new.toml --from old.lbea --work more --index 0 --of 1").exit_code == 0);
  CHECK(lbea_bake(folder, "plan new.toml --from old.lbea --work more -o steps.lbea").exit_code == 0);
  CHECK(lbea_bake(folder, "shard --work more --index 0 --of 1").exit_code == 0);
  CHECK(lbea_bake(folder, "merge --work more").exit_code == 0);
  CHECK(text_of(folder / "steps.lbea") == text_of(folder / "new.lbea"));

  put(folder / "eroding/B2.vtk", block(corner));
  const Outcome outcome = lbea_bake(folder, "e.toml -o m.lbea");
  CHECK(contains(outcome.out, "eroding        3 of 54 elements in some samples of 1 runs (eroding)"));
  put(folder / "whole/B1.vtk", block(corner));  // now no sample has it
  put(folder / "whole/B2.vtk", block(corner));
  put(folder / "eroding/B1.vtk", block(corner));
  const Outcome never = lbea_bake(folder, "e.toml -o m.lbea");
  CHECK(contains(never.out, "3 of 54 elements and 1 of 56 nodes: 3 eroded in all samples, 0 not in all runs"));
  CHECK(contains(outcome.out, "added          3 faces that erosion exposes"));
}

TEST_CASE("five files of a numbered series, named together, were five equal runs of five states each") {
  const TemporaryFolder folder;
  for (int i = 1; i <= 5; ++i) put(folder / ("finals/shape" + std::to_string(i) + ".obj"), plate(i));
  put(folder / "e.toml", "runs = ['finals/*.obj']\nfields = []\nmodes = 10\n");
  const Outcome outcome = lbea_bake(folder, "e.toml -o m.lbea");
  REQUIRE_MESSAGE(outcome.exit_code == 0, outcome.err);
  const Model model = Model::open(folder / "m.lbea");
  CHECK(model.simulations() == 5);
  REQUIRE(model.samples() == 5);
  for (std::uint32_t i = 0; i < 5; ++i)
    CHECK(model.node_positions(i)[3 * 14 + 2] == static_cast<float>(-(i + 1.0) * 2 * 3 * 2 * 3 / 36));

  CHECK(lbea_bake(folder, "plan e.toml --work work -o steps.lbea").exit_code == 0);
  CHECK(lbea_bake(folder, "shard --work work --index 0 --of 1").exit_code == 0);
  CHECK(lbea_bake(folder, "merge --work work").exit_code == 0);
  CHECK(text_of(folder / "steps.lbea") == text_of(folder / "m.lbea"));

  put(folder / "series.toml", "runs = ['finals/shape3.obj']\nfields = []\nmodes = 10\n");
  CHECK(lbea_bake(folder, "series.toml -o series.lbea").exit_code == 0);
  CHECK(Model::open(folder / "series.lbea").samples() == 5);  // named alone, a file stands for its series
}

TEST_CASE("runs that share a file are refused") {
  const TemporaryFolder folder;
  for (int i = 1; i <= 2; ++i) put(folder / ("run/shape" + std::to_string(i) + ".obj"), plate(i));
  put(folder / "e.toml", "runs = ['run', 'run/shape2.obj']\nfields = []\nmodes = 10\n");
  for (const char* command : {"e.toml -o m.lbea", "e.toml -o m.lbea --leave-out-broken", "plan e.toml --work work"}) {
    const Outcome outcome = lbea_bake(folder, command);
    CHECK(outcome.exit_code == 1);
    CHECK_MESSAGE(contains(outcome.err, "the runs 'run' and 'shape2.obj' both read "), outcome.err);
    CHECK_FALSE(std::filesystem::exists(folder / "m.lbea"));
  }
}

TEST_CASE("runs may include the same file, whose changes after the plan are noticed") {
  const TemporaryFolder folder;
  std::string shells = "*ELEMENT_SHELL\n";
  for (int cell = 0; cell < 25; ++cell) {
    const int corner = 1 + cell % 5 + 6 * (cell / 5);
    shells += std::to_string(cell + 1) + ",1";
    for (const int node : {corner, corner + 1, corner + 7, corner + 6}) shells += "," + std::to_string(node);
    shells += "\n";
  }
  put(folder / "shells.k", shells);
  for (const int depth : {1, 2, 3}) {
    std::string nodes = "*KEYWORD\n*INCLUDE\nshells.k\n*NODE\n";
    for (int node = 0; node < 36; ++node) {
      const int x = node % 6, y = node / 6;
      nodes += std::to_string(node + 1) + "," + std::to_string(10 * x) + "," + std::to_string(10 * y) + "," +
               std::to_string(-depth * x * (5 - x) * y * (5 - y)) + "\n";
    }
    put(folder / ("depth_" + std::string(static_cast<std::size_t>(depth), 'i') + ".k"), nodes);
  }
  put(folder / "e.toml", "runs = ['depth_*.k']\nfields = []\nmodes = 10\n");
  const Outcome outcome = lbea_bake(folder, "e.toml -o m.lbea");
  REQUIRE_MESSAGE(outcome.exit_code == 0, outcome.err);
  const Model model = Model::open(folder / "m.lbea");
  CHECK(model.samples() == 3);
  const auto inputs = nlohmann::json::parse(model.provenance())["inputs"];
  for (const auto& run : inputs) {
    REQUIRE(run["files"].size() == 2);
    CHECK(run["files"][1]["name"] == "shells.k");
  }
  REQUIRE(lbea_bake(folder, "plan e.toml --work work -o steps.lbea").exit_code == 0);
  std::filesystem::last_write_time(folder / "shells.k", std::filesystem::file_time_type::clock::now() + 1h);
  CHECK(lbea_bake(folder, "shard --work work --index 0 --of 1").exit_code == 3);  // runs have failed
  const Outcome status = lbea_bake(folder, "status --work work");
  CHECK_MESSAGE(contains(status.out, "depth_i.k changed since the bake was planned"), status.out);
}

TEST_CASE("two copies of one run, which halve each other's probability, are named, without control characters") {
  const TemporaryFolder folder;
  for (const char* run : {"a\x1b[31m", "b", "c"})
    for (int i = 1; i <= 3; ++i)
      put(folder / (std::string(run) + "/shape" + std::to_string(i) + ".obj"), plate(*run == 'c' ? i + 1 : i));
  put(folder / "e.toml", "runs = ['a*', 'b', 'c']\nfields = []\nmodes = 10\n");
  const Outcome outcome = lbea_bake(folder, "e.toml -o m.lbea");
  REQUIRE(outcome.exit_code == 0);
  CHECK_MESSAGE(contains(outcome.out, "warning        runs a\\x1b[31m and b have the same content"), outcome.out);
  CHECK_FALSE(contains(outcome.out, "and c"));
  CHECK_FALSE(contains(outcome.out, "\x1b"));
}

TEST_CASE("a last state that the files cut short is left out, which the summary says") {
  const TemporaryFolder folder;
  std::filesystem::copy(data() / "rail-demo/runs/run_023", folder / "run");
  std::filesystem::permissions(folder / "run/d3plot01", std::filesystem::perms::owner_all);
  std::filesystem::resize_file(folder / "run/d3plot01", std::filesystem::file_size(folder / "run/d3plot01") - 20'000);
  put(folder / "e.toml", "runs = ['run']\nfields = []\nmodes = 10\n");
  const Outcome outcome = lbea_bake(folder, "e.toml -o m.lbea");
  REQUIRE_MESSAGE(outcome.exit_code == 0, outcome.err);
  CHECK(Model::open(folder / "m.lbea").samples() == 20);
  CHECK_MESSAGE(
      contains(outcome.out, "d3plot01 ends in the middle of a state, which is left out; is the run complete?"),
      outcome.out);
}

TEST_CASE("100 modes of 36 vertices, times in ms without time_unit, a field that no file has: said in the summary") {
  const TemporaryFolder folder;
  for (int i = 1; i <= 9; ++i) put(folder / ("run/shape" + std::to_string(i) + ".obj"), plate(i));
  put(folder / "e.toml", "runs = ['run']\nfields = []\n");
  const Outcome outcome = lbea_bake(folder, "e.toml -o m.lbea");
  CHECK_MESSAGE(outcome.exit_code == 0, outcome.err);
  CHECK(Model::open(folder / "m.lbea").modes() == 36);
  CHECK(contains(outcome.out, "warning        100 modes were asked of a region with 36 vertices"));
  CHECK(contains(outcome.out, "warning        the longest run takes 8 s; is time_unit right?"));
  CHECK(contains(outcome.out, "size           50 x 50 x 9 mm, all samples"));
  CHECK(contains(outcome.out, "times          0 s to 8 s, 1 s apart"));
  put(folder / "e.toml", "runs = ['run']\n");
  const Outcome field = lbea_bake(folder, "e.toml -o m.lbea");
  CHECK(field.exit_code == 1);
  CHECK(
      contains(field.err, "it has: none; choose fields that all runs have, or none with fields = [] or --fields none"));
  const Outcome none = lbea_bake(folder, "e.toml --fields none -o m.lbea");
  CHECK_MESSAGE(none.exit_code == 0, none.err);
}

TEST_CASE("the demo is baked from its TOML file; flags override it") {
  const TemporaryFolder folder;
  const Outcome outcome = lbea_bake(folder, demo + "/ensemble.toml" + three_steps);
  CHECK_MESSAGE(outcome.exit_code == 0, outcome.err);
  CHECK(outcome.out.find("30 of 10 simulations") != std::string::npos);
  CHECK(outcome.out.find("10 modes") != std::string::npos);
  CHECK(outcome.out.find("kept variance") != std::string::npos);
  CHECK(contains(outcome.out, "field          plastic_strain: largest of the integration points"));
  const Model model = Model::open(folder / "ensemble.lbea");  // named after the TOML file, in the working folder
  CHECK(model.samples() == 30);
  CHECK(model.modes() == 10);
  CHECK(model.vertices() == 1276);
  CHECK(model.parameters() == 12);
  CHECK(model.parameter_name(0) == "t_front [mm]");
  CHECK(model.simulation_name(0) == "run_023");
}

TEST_CASE("runs and region given by flags give the same model as a TOML file") {
  const TemporaryFolder folder;
  std::ofstream(folder / "two.toml") << "runs = ['" << demo << "/runs/run_023', '" << demo << "/runs/run_038']\n"
                                     << "reference_run = 'run_038'\nmode = 'over-time'\n"
                                     << "[region]\nnodes = '" << demo << "/region-nodes.txt'\n";
  CHECK(lbea_bake(folder, "two.toml -o a.lbea" + three_steps).exit_code == 0);
  const std::string flags = "--run " + demo + "/runs/run_023 --run " + demo + "/runs/run_038/d3plot" +
                            " --reference run_038 --mode over-time --region-nodes " + demo + "/region-nodes.txt";
  for (const char* threads : {" --threads 1", " --threads 3"}) {
    const Outcome outcome = lbea_bake(folder, flags + three_steps + "-o b.lbea" + threads);
    CHECK_MESSAGE(outcome.exit_code == 0, outcome.err);
    CHECK(text_of(folder / "a.lbea") == text_of(folder / "b.lbea"));
  }
  const Model model = Model::open(folder / "b.lbea");
  CHECK(model.references() == 3);
  CHECK(model.simulation_name(1) == "run_038");
}

TEST_CASE("--json prints the summary and nothing else") {
  const TemporaryFolder folder;
  const Outcome outcome = lbea_bake(folder, demo + "/ensemble.toml -o m.lbea --json" + three_steps);
  const auto json = nlohmann::json::parse(outcome.out);
  CHECK(json["samples"] == 30);
  CHECK(json["modes"] == 10);
  CHECK(json["file_size"] == std::filesystem::file_size(folder / "m.lbea"));
  CHECK(json["kept_variance"].get<double>() > 0.5);
  CHECK(json["basis_residual"].get<double>() < 1e-10);
}

TEST_CASE("the region: nodes that the sensor sees, parts and a box") {
  const TemporaryFolder folder;
  const std::string run = "--run " + demo + "/runs/run_023 --json -o m.lbea" + three_steps;
  const auto vertices = [&](const std::string& flags) {
    const Outcome outcome = lbea_bake(folder, run + flags);
    REQUIRE_MESSAGE(outcome.exit_code == 0, outcome.err);
    return nlohmann::json::parse(outcome.out)["vertices"].get<int>();
  };
  CHECK(vertices("") == 2436);
  const int seen = vertices("--sensor " + demo + "/sensor.json");
  CHECK(seen > 500);
  CHECK(seen < 2436);
  CHECK(vertices("--views " + demo + "/sensor.json") == seen);  // by default: what the rigs of the depth images see
  const int part = vertices("--region-parts 1,2");
  CHECK(part < 2436);
  const int boxed = vertices("--region-parts 1,2 --region-box -1 -100 -100 200 100 100");
  CHECK(boxed < part);
  CHECK(vertices("--views " + demo + "/sensor.json --region-parts 1,2") == part);
  CHECK(vertices("--region-box -1 -100 -100 500 100 100") == 2436);
}

TEST_CASE("without a region, a node counts that one of the views' rigs sees; rigs that see none are refused") {
  const TemporaryFolder folder;
  nlohmann::json rig = opposite_rig(demo + "/sensor.json");
  put(folder / "opposite.json", rig.dump());
  const std::string run = "--run " + demo + "/runs/run_023 --json -o m.lbea" + three_steps;
  const auto vertices = [&](const std::string& views) {
    const Outcome outcome = lbea_bake(folder, run + views);
    REQUIRE_MESSAGE(outcome.exit_code == 0, outcome.err);
    return nlohmann::json::parse(outcome.out)["vertices"].get<int>();
  };
  const int left = vertices(" --views " + demo + "/sensor.json"), right = vertices(" --views opposite.json");
  const int both = vertices(" --views " + demo + "/sensor.json --views opposite.json");
  CHECK(both > std::max(left, right));
  CHECK(both < left + right);
  for (nlohmann::json* rows : {&rig["T_reference_sensor"], &rig["sensor"]["T_reference_right"]})
    (*rows)[0][3] = (*rows)[0][3].get<double>() + 1e5;
  put(folder / "far.json", rig.dump());
  const Outcome refused = lbea_bake(folder, run + " --views far.json");
  CHECK(refused.exit_code == 1);
  CHECK_MESSAGE(contains(refused.err, "no sensor sees the component at impact"), refused.err);
}

TEST_CASE("--correspondence false leaves out the correspondence") {
  const TemporaryFolder folder;
  CHECK(lbea_bake(folder, demo + "/ensemble.toml -o with.lbea" + three_steps).exit_code == 0);
  CHECK(lbea_bake(folder, demo + "/ensemble.toml -o without.lbea --correspondence false" + three_steps).exit_code == 0);
  const auto saved =
      std::filesystem::file_size(folder / "with.lbea") - std::filesystem::file_size(folder / "without.lbea");
  const std::size_t section = 30 * 1276 * 4;
  CHECK(saved >= section);
  CHECK(saved <= section + 2 * 64);  // its directory entry and padding
  CHECK(Model::open(folder / "without.lbea").samples() == 30);
}

TEST_CASE("wrong usage and failure have different exit codes and leave no file") {
  check_refused("", 2, "name an ensemble.toml, or runs with --run");
  check_refused("--run x", 2, "name the model with -o");
  check_refused(demo + "/ensemble.toml --steps 3:1", 2, "'3:1' is not all, N, FIRST:LAST");
  check_refused(demo + "/ensemble.toml --steps 1,x", 2, "is not all");
  check_refused(demo + "/ensemble.toml --mode sideways", 2, "--mode");
  check_refused(demo + "/ensemble.toml --nonsense", 2, "--nonsense");
  check_refused("none.toml", 1, "none.toml");
  check_refused(demo + "/ensemble.toml --modes 2000", 1, "2000 modes asked of a region with 1276 vertices");
  check_refused(demo + "/ensemble.toml --reference none", 1, "the reference run 'none' is none of the runs");
  check_refused(demo + "/ensemble.toml --steps 30", 1, "has no state 30, only 21");
  check_refused(demo + "/ensemble.toml --fields stress", 1, "has no field 'stress'; it has: plastic_strain");
  check_refused(demo + "/ensemble.toml -o none/m.lbea", 1, "none/m.lbea");
  check_refused("--run none -o m.lbea", 1, "none");
}

TEST_CASE("--help prints an example, --version the version") {
  const TemporaryFolder folder;
  const Outcome help = lbea_bake(folder, "--help");
  CHECK(help.exit_code == 0);
  CHECK(help.out.find("lbea-bake ensemble.toml -o rail.lbea") != std::string::npos);
  CHECK(lbea_bake(folder, "--version").out == "lbea-bake " LBEA_VERSION_STRING "\n");
}

TEST_CASE("Ctrl-C leaves no file") {
  constexpr int too_early = 128 + SIGINT;  // the program did not handle the signal yet
  const TemporaryFolder folder;
  const std::string command = std::string(LBEA_BAKE) + " " + demo + "/ensemble.toml --mode over-time --threads 1";
  Outcome outcome{.exit_code = too_early};
  for (int delay = 200; outcome.exit_code == too_early && delay < 10000; delay *= 3)
    outcome = run_program(command, folder.path(), std::chrono::milliseconds(delay));
  CHECK(outcome.exit_code == 1);
  CHECK(outcome.err.find("cancelled") != std::string::npos);
  CHECK(std::filesystem::is_empty(folder.path()));
}
