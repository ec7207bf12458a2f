// lbea-bake and lbea-inspect with channels that are histories of LS-DYNA runs.
#include "tests/support/program.hpp"
#include "tests/support/refusals.hpp"

#include <lbea/lbea.hpp>

#include <doctest/doctest.h>
#include <nlohmann/json.hpp>

#include <array>
#include <cstring>
#include <fstream>

using namespace lbea;
using namespace lbea::test;

namespace {

constexpr std::array<const char*, 3> runs{"run_023", "run_038", "run_045"};
constexpr std::size_t internal_energy = 1;  // among the global values

/// Exact in single precision.
float energy(std::size_t run, std::size_t state) { return static_cast<float>(512 * run + 4 * state * state); }

std::vector<char> bytes_of(const std::filesystem::path& file) {
  const std::string text = text_of(file);
  return {text.begin(), text.end()};
}

template <class Word>
Word word_at(const std::vector<char>& bytes, std::size_t word) {
  Word value;
  std::memcpy(&value, &bytes.at(4 * word), 4);
  return value;
}

/// A run of the demo, whose global values are zeros, with internal energies. Its states are in d3plot01.
void write_run(const TemporaryFolder& folder, std::size_t run) {
  const std::filesystem::path from = data() / "rail-demo/runs" / runs[run], to = folder / runs[run];
  std::filesystem::create_directory(to);
  std::filesystem::copy_file(from / "d3plot", to / "d3plot");
  const std::vector<char> control = bytes_of(from / "d3plot");
  const auto count = [&](std::size_t word) { return static_cast<std::size_t>(word_at<std::int32_t>(control, word)); };
  const std::size_t nodes = count(16), globals = count(18), shells = count(31), row = count(33);
  REQUIRE(globals == 6);
  const std::size_t state_words = 1 + globals + 3 * nodes + shells * row + shells;
  std::vector<char> states = bytes_of(from / "d3plot01");
  std::size_t state = 0;
  for (std::size_t word = 0; word_at<float>(states, word) >= 0; word += state_words, ++state) {
    const float value = energy(run, state);
    std::memcpy(&states.at(4 * (word + 1 + internal_energy)), &value, 4);
  }
  REQUIRE(state == 21);
  std::ofstream(to / "d3plot01", std::ios::binary).write(states.data(), static_cast<std::streamsize>(states.size()));
}

struct Runs {
  Runs() {
    for (std::size_t run = 0; run < runs.size(); ++run) write_run(folder, run);
  }
  /// channel: its keys after the name.
  [[nodiscard]] Outcome bake(const std::string& channel) const {
    std::ofstream(folder / "e.toml") << "runs = ['run_*']\nfields = []\nmodes = 10\n[[channel]]\nname = 'energy'\n"
                                     << channel << "\n";
    return run_program(LBEA_BAKE " e.toml -o m.lbea", folder.path());
  }
  TemporaryFolder folder;
};

const std::string of_run = "kind = 'history'\nhistory = 'internal_energy'\nunit = 'kJ'";

}  // namespace

TEST_CASE("a history is baked from the runs' global values, shown, and given for every frame") {
  const Runs ensemble;
  const Outcome outcome = ensemble.bake(of_run);
  REQUIRE_MESSAGE(outcome.exit_code == 0, outcome.err);
  CHECK_MESSAGE(contains(outcome.out, "channel        energy [kJ]: history internal_energy\n"), outcome.out);
  CHECK_FALSE(contains(outcome.out, "does the solver write it"));
  const Model model = Model::open(ensemble.folder / "m.lbea");
  REQUIRE(model.samples() == 3 * 21);
  for (std::uint32_t s = 0; s < model.samples(); ++s)
    CHECK(model.channel_value(0, s) == energy(model.sample(s).simulation, model.sample(s).time_step));

  Matcher matcher(model);
  const auto positions = model.node_positions(50);
  std::vector<Point> points;
  for (std::size_t i = 0; i < positions.size(); i += 3)
    points.push_back({positions[i], positions[i + 1], positions[i + 2]});
  const MatchResult result = matcher.match({1, 0, points});
  REQUIRE(result.channels.size() == 1);
  CHECK(result.channels[0].value == model.channel_value(0, 50));

  const auto inspect = [&](const char* arguments) {
    return run_program(LBEA_INSPECT + std::string(arguments), ensemble.folder.path()).out;
  };
  const auto channel = nlohmann::json::parse(inspect(" m.lbea --json"))["channels"][0];
  CHECK(channel["kind"] == "history");
  CHECK(channel["history"] == "internal_energy");
  CHECK(channel["unit"] == "kJ");
  CHECK(contains(inspect(" m.lbea"), "[kJ] history internal_energy, CFC 0\n"));
}

TEST_CASE("a history that the runs lack, or that is 0, is said") {
  const Runs ensemble;
  const Outcome lacking = ensemble.bake("kind = 'history'\nhistory = 'part_mass'\npart = 1\nunit = 'kg'");
  CHECK(lacking.exit_code == 1);
  CHECK_MESSAGE(contains(lacking.err,
                         "has no history 'part_mass'; it has: kinetic_energy, internal_energy, "
                         "total_energy, velocity_x, velocity_y, velocity_z"),
                lacking.err);
  const Outcome zeros = ensemble.bake("kind = 'history'\nhistory = 'total_energy'\nunit = 'kJ'");
  CHECK_MESSAGE(zeros.exit_code == 0, zeros.err);
  CHECK_MESSAGE(contains(zeros.out, "channel 'energy': history 'total_energy' is 0 in all used states of run run_023"),
                zeros.out);
}
