#include "adapters/ensemble/ensemble_toml.hpp"
#include "tests/support/files.hpp"
#include "tests/support/refusals.hpp"
#include "tests/support/test_data.hpp"

#include <doctest/doctest.h>

using namespace lbea;
using namespace lbea::bake;
using namespace lbea::io;
using namespace lbea::test;

namespace {

/// A folder with the runs a, b, c and what `text` makes of them.
struct EnsembleFile {
  TemporaryFolder folder;
  explicit EnsembleFile() {
    for (const char* run : {"a", "b", "c"}) std::filesystem::create_directories(folder / "runs" / run);
  }
  [[nodiscard]] std::filesystem::path run(const std::string& name) const { return folder / "runs" / name; }
  [[nodiscard]] EnsembleDescription read(const std::string& text) const {
    return read_ensemble_toml(put(folder / "ensemble.toml", text));
  }
};

using Counts = std::vector<std::uint32_t>;

}  // namespace

TEST_CASE("depth images are rendered for one rig or for several") {
  const EnsembleFile ensemble;
  const EnsembleDescription one = ensemble.read("runs = ['runs/*']\nviews = 'a.json'\n");
  CHECK(one.depth_sensor == ensemble.folder / "a.json");
  CHECK(one.more_depth_sensors.empty());
  const EnsembleDescription three = ensemble.read("runs = ['runs/*']\nviews = ['a.json', 'rigs/b.json', 'c.json']\n");
  CHECK(three.depth_sensor == ensemble.folder / "a.json");
  CHECK(three.more_depth_sensors ==
        std::vector<std::filesystem::path>{ensemble.folder / "rigs/b.json", ensemble.folder / "c.json"});
}

TEST_CASE("channels are read in their order, with nodes and places") {
  const EnsembleFile ensemble;
  const auto channels = ensemble
                            .read(R"(runs = ["runs/*"]
[[channel]]
name = "free end"
kind = "velocity"
component = "x"
cfc = 60
points = [4711]
[[channel]]
name = "gap"
kind = "distance"
points = [[0.5, 1, -2], 7]
reach = 4
)")
                            .channels;
  REQUIRE(channels.size() == 2);
  CHECK(channels[0].name == "free end");
  CHECK(channels[0].kind == ChannelKind::velocity);
  CHECK(channels[0].component == ChannelComponent::x);
  CHECK(channels[0].cfc == 60);
  REQUIRE(channels[0].points.size() == 1);
  CHECK(channels[0].points[0].is_node);
  CHECK(channels[0].points[0].node == 4711);
  CHECK_FALSE(channels[0].reach.has_value());
  REQUIRE(channels[1].points.size() == 2);
  CHECK(channels[1].component == ChannelComponent::resultant);
  CHECK_FALSE(channels[1].points[0].is_node);
  CHECK(channels[1].points[0].position == std::array{0.5, 1.0, -2.0});
  CHECK(channels[1].points[1].node == 7);
  CHECK(channels[1].reach == 4);
}

TEST_CASE("channels of a field are read with parts and elements") {
  const EnsembleFile ensemble;
  const auto channels = ensemble
                            .read(R"(runs = ["runs/*"]
[[channel]]
name = "strain"
kind = "maximum"
field = "plastic_strain"
parts = [3]
elements = [501, 7]
[[channel]]
name = "mean"
kind = "mean"
field = "stress"
)")
                            .channels;
  REQUIRE(channels.size() == 2);
  CHECK(channels[0].kind == ChannelKind::maximum);
  CHECK(channels[0].field == "plastic_strain");
  CHECK(channels[0].parts == std::vector<std::uint32_t>{3});
  CHECK(channels[0].elements == std::vector<std::uint32_t>{501, 7});
  CHECK(channels[1].kind == ChannelKind::mean);
  CHECK(channels[1].parts.empty());
  CHECK(channels[1].elements.empty());
}

TEST_CASE("channels that are histories are read with their part or wall") {
  const EnsembleFile ensemble;
  const auto channels = ensemble
                            .read(R"(runs = ["runs/*"]
[[channel]]
name = "energy"
kind = "history"
history = "internal_energy"
unit = "kJ"
[[channel]]
name = "mass"
kind = "history"
history = "part_mass"
part = 5
unit = "kg"
cfc = 60
[[channel]]
name = "force"
kind = "history"
history = "rigid_wall_force"
wall = 2
unit = "kN"
)")
                            .channels;
  REQUIRE(channels.size() == 3);
  CHECK(channels[0].kind == ChannelKind::history);
  CHECK(channels[0].history.text() == "internal_energy");
  CHECK(channels[0].unit == "kJ");
  CHECK(channels[1].history.text() == "part_mass of part 5");
  CHECK(channels[1].cfc == 60);
  CHECK(channels[2].history.text() == "rigid_wall_force of wall 2");
}

TEST_CASE("what is not said keeps its default") {
  const EnsembleFile ensemble;
  const EnsembleDescription read = ensemble.read("runs = [\"runs/*\"]"), standard;
  CHECK(read.runs == std::vector{ensemble.run("a"), ensemble.run("b"), ensemble.run("c")});
  CHECK(read.reference_run.empty());
  CHECK(read.impact_step == standard.impact_step);
  CHECK(read.steps.first == standard.steps.first);
  CHECK(read.steps.last == standard.steps.last);
  CHECK(read.steps.stride == standard.steps.stride);
  CHECK(read.steps.list.empty());
  CHECK(read.mode == standard.mode);
  CHECK(read.modes == standard.modes);
  CHECK(read.region.parts.empty());
  CHECK_FALSE(read.region.box.has_value());
  CHECK(read.region.node_ids.empty());
  CHECK(read.region.node_file.empty());
  CHECK(read.region.sensors.empty());
  CHECK(read.fields == standard.fields);
  CHECK(read.parameters.empty());
  CHECK(read.length_unit == standard.length_unit);
  CHECK(read.time_factor == standard.time_factor);
  CHECK(read.envelope_margin == standard.envelope_margin);
  CHECK(read.correspondence == standard.correspondence);
  CHECK(read.output.empty());
}

TEST_CASE("everything said is taken over, paths relative to the file") {
  const EnsembleFile ensemble;
  const EnsembleDescription read = ensemble.read(R"(
runs = ["runs/c", "runs/a", "runs/b"]
exclude = ["b"]
reference_run = "runs/a"
impact_step = 3
mode = "over-time"
modes = 50
fields = ["plastic_strain", "stress"]
parameters = "../tables/p.csv"
length_unit = "m"
time_unit = 0.25
envelope_margin = 0
correspondence = false
output = "out/model.lbea"
[steps]
first = 4
last = 20
stride = 2
[region]
parts = [1, 4]
box = {min = [0, -30.5, 0], max = [400, 30.5, 1e3]}
nodes = [11, 4294967295]
sensor = "sensor.json"
)");
  CHECK(read.runs == std::vector{ensemble.run("c"), ensemble.run("a")});
  CHECK(read.reference_run == ensemble.run("a"));
  CHECK(read.impact_step == 3);
  CHECK(read.steps.first == 4);
  CHECK(read.steps.last == 20);
  CHECK(read.steps.stride == 2);
  CHECK(read.mode == ReferenceMode::over_time);
  CHECK(read.modes == 50);
  CHECK(read.region.parts == Counts{1, 4});
  REQUIRE(read.region.box.has_value());
  CHECK(read.region.box->min == std::array<double, 3>{0, -30.5, 0});
  CHECK(read.region.box->max == std::array<double, 3>{400, 30.5, 1000});
  CHECK(read.region.node_ids == Counts{11, 4'294'967'295});
  CHECK(read.region.node_file.empty());
  CHECK(read.region.sensors == std::vector{ensemble.folder / "sensor.json"});
  CHECK(read.fields == std::vector<std::string>{"plastic_strain", "stress"});
  CHECK(read.parameters == ensemble.folder.path().parent_path() / "tables/p.csv");
  CHECK(read.length_unit == "m");
  CHECK(read.time_factor == 0.25);
  CHECK(read.envelope_margin == 0);
  CHECK_FALSE(read.correspondence);
  CHECK(read.output == ensemble.folder / "out/model.lbea");
}

TEST_CASE("the shorter ways to say it") {
  const EnsembleFile ensemble;
  const std::string runs = "runs = [\"runs/*\"]\n";
  CHECK(ensemble.read(runs + "steps = [8, 0, 4]").steps.list == Counts{0, 4, 8});
  CHECK(ensemble.read(runs + "impact_step = 5").steps.first == 5);
  CHECK(ensemble.read(runs + "impact_step = 5\nsteps = {stride = 2}").steps.first == 5);
  CHECK(ensemble.read(runs + "impact_step = 5\nsteps = {first = 1}").steps.first == 1);
  CHECK(ensemble.read(runs + "fields = \"all\"").fields == std::vector<std::string>{"all"});
  CHECK(ensemble.read(runs + "fields = []").fields.empty());
  CHECK(ensemble.read(runs + "time_unit = \"s\"").time_factor == 1);
  CHECK(ensemble.read(runs + "time_unit = \"ms\"").time_factor == 1e-3);
  CHECK(ensemble.read(runs + "time_unit = \"us\"").time_factor == 1e-6);
  CHECK(ensemble.read(runs + "region.nodes = \"n.txt\"").region.node_file == ensemble.folder / "n.txt");
  CHECK(ensemble.read(runs + "reference_run = \"b\"").reference_run == ensemble.run("b"));
  CHECK(ensemble.read("runs = [\"runs/b\", \"runs/*\", \"runs/c/\"]").runs ==
        std::vector{ensemble.run("b"), ensemble.run("a"), ensemble.run("c")});
}

TEST_CASE("how runs with other meshes are mapped") {
  const EnsembleFile ensemble;
  const auto read = [&](const std::string& keys) { return ensemble.read("runs = [\"runs/*\"]\n" + keys).mapping; };
  const MappingSettings standard = read("");
  CHECK(standard.enabled);
  CHECK(standard.distance_in("cm") == doctest::Approx(0.3));
  CHECK(standard.mean_distance_in("mm") == doctest::Approx(1));
  CHECK(standard.by_part);
  const MappingSettings all =
      read("mapping = {enabled = false, distance = 2, share = 0.9, parts = {101 = 1, 4294967295 = 2}}");
  CHECK_FALSE(all.enabled);
  CHECK(all.distance_in("cm") == 2);
  CHECK(all.share == 0.9);
  CHECK(all.parts == std::vector<std::array<std::uint32_t, 2>>{{101, 1}, {4'294'967'295, 2}});
  CHECK_FALSE(read("mapping.parts = \"ignore\"").by_part);
}

TEST_CASE("the nodes whose rigid motion is removed") {
  const EnsembleFile ensemble;
  const auto read = [&](const std::string& keys) { return ensemble.read("runs = [\"runs/*\"]\n" + keys).rigid; };
  CHECK_FALSE(read("").are_set);
  CHECK(read("rigid = \"fit\"").are_set);
  CHECK(read("rigid = \"fit\"").ids.empty());
  CHECK(read("rigid = [12, 40, 7]").ids == std::vector<std::uint32_t>{12, 40, 7});
}

TEST_CASE("the demo ensemble in the repository") {
  const auto folder = data() / "rail-demo";
  const EnsembleDescription demo = read_ensemble_toml(folder / "ensemble.toml");
  REQUIRE(demo.runs.size() == 10);
  CHECK(demo.runs.front() == folder / "runs/run_023");
  CHECK(demo.runs.back() == folder / "runs/run_129");
  CHECK(read_node_ids(demo.region.node_file).size() == 1276);
  const ParameterTable table = read_parameters_csv(demo.parameters);
  CHECK(table.names.size() == 12);
  CHECK(table.names[0] == "t_front");
  CHECK(table.units[0] == "mm");
  for (const auto& run : demo.runs) {
    CAPTURE(run);
    CHECK(table.row(run.filename().string()).has_value());
  }
  CHECK(table.row("run_129")->back() == 0.239871);
}
