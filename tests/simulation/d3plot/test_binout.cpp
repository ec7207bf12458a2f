// Histories of binout beside d3plot: every number at its time, families of files, interrupted and damaged files.
#include "adapters/simulation/open.hpp"
#include "tests/support/binout_writer.hpp"
#include "tests/support/d3plot_writer.hpp"
#include "tests/support/refusals.hpp"
#include "tests/support/test_data.hpp"

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>

using namespace lbea;
using namespace lbea::test;
using bake::HistorySeries;
using bake::SimulationReader;

namespace {

constexpr std::size_t per_state = 8;  // states of binout per state of d3plot

/// Exact in single precision, and linear in time between the states of d3plot.
float binout_number(std::size_t state, std::size_t variable, std::size_t owner) {
  return static_cast<float>(16 * state + 4 * variable + owner);
}

std::string name_of_state(std::size_t state) {
  return "d" + std::string(state < 9 ? "00000" : "0000") + std::to_string(state + 1);
}

template <class Time>
void write_state(BinoutWriter& file, const std::string& database, std::size_t state, Time time,
                 std::initializer_list<const char*> names, std::size_t owners) {
  file.change_directory(database + "/" + name_of_state(state));
  file.write("time", std::span<const Time>(&time, 1));
  const std::int32_t cycle = 3;
  file.write("cycle", std::span<const std::int32_t>(&cycle, 1));
  std::size_t variable = 0;
  for (const char* name : names) {
    std::vector<float> values;
    for (std::size_t owner = 0; owner < owners; ++owner) values.push_back(binout_number(state, variable, owner));
    file.write(name, std::span<const float>(values));
    ++variable;
  }
  file.write_symbols("time");
}

void write_ids(BinoutWriter& file, const std::string& database, std::vector<std::int32_t> ids) {
  file.change_directory(database + "/metadata");
  file.write("ids", std::span<const std::int32_t>(ids));
  file.change_directory("..");
}

/// interval: of binout.
BinoutWriter sample_binout(std::size_t states, double interval, double begin = 0) {
  BinoutWriter file;
  write_ids(file, "/matsum", {100, 300});
  write_ids(file, "/rwforc/forces", {7});
  for (std::size_t s = 0; s < states; ++s) {
    const double time = begin + interval * static_cast<double>(s);
    write_state(file, "/glstat", s, time, {"kinetic_energy", "hourglass_energy"}, 1);
    write_state(file, "/matsum", s, static_cast<float>(time), {"internal_energy"}, 2);
    write_state(file, "/rwforc/forces", s, time, {"x_force"}, 1);
    write_state(file, "/nodout", s, time, {"x_displacement"}, 3);
  }
  return file;
}

struct Run {
  explicit Run(std::size_t states = 4) : database(sample_d3plot(states)) {
    for (std::size_t s = 0; s < states; ++s) database.states[s].time = 0.5 * static_cast<double>(s);
    file = write_d3plot(database, folder.path());
  }
  [[nodiscard]] std::unique_ptr<SimulationReader> open() const { return io::open_simulation(file); }
  [[nodiscard]] static double interval() { return 0.5 / per_state; }
  [[nodiscard]] std::size_t binout_states() const { return (database.states.size() - 1) * per_state + 1; }

  TemporaryFolder folder;
  D3plot database;
  std::filesystem::path file;
};

/// Of the run's histories; its size if it does not have it.
std::uint32_t place_of(SimulationReader& run, const std::string& name) {
  std::uint32_t place = 0;
  for (const bake::SimulationHistory& history : run.histories()) {
    if (history.name == name) return place;
    place += static_cast<std::uint32_t>(history.size());
  }
  return place;
}

std::vector<std::string> of_binout(SimulationReader& run) {
  std::vector<std::string> names;
  for (const bake::SimulationHistory& history : run.histories())
    if (history.name.find('.') != std::string::npos) names.push_back(history.name);
  return names;
}

}  // namespace

TEST_CASE("binout: every number is the written one, at its time and at those of the states") {
  const Run run;
  sample_binout(run.binout_states(), Run::interval()).save(run.folder / "binout");
  const auto opened = run.open();
  CHECK(opened->files().size() == 1);  // nothing needs the histories yet
  REQUIRE(of_binout(*opened) == std::vector<std::string>{"glstat.hourglass_energy", "glstat.kinetic_energy",
                                                         "matsum.internal_energy", "rwforc.x_force"});
  CHECK(opened->remark().empty());
  const auto histories = opened->histories();
  CHECK(std::ranges::find(histories, "matsum.internal_energy", &bake::SimulationHistory::name)->ids ==
        std::vector<std::uint32_t>{100, 300});
  struct Case {
    const char* name;
    std::uint32_t owner;
    std::size_t variable;
  };
  for (const Case& c :
       {Case{"glstat.kinetic_energy", 0, 0}, Case{"glstat.hourglass_energy", 0, 1},
        Case{"matsum.internal_energy", 0, 0}, Case{"matsum.internal_energy", 1, 0}, Case{"rwforc.x_force", 0, 0}}) {
    CAPTURE(c.name);
    const std::uint32_t place = place_of(*opened, c.name) + c.owner;
    const HistorySeries series = opened->history_series(place);
    REQUIRE(series.times.size() == run.binout_states());
    for (std::size_t s = 0; s < series.times.size(); ++s) {
      CHECK(series.times[s] == Run::interval() * static_cast<double>(s));
      CHECK(series.values[s] == double{binout_number(s, c.variable, c.owner)});
    }
    for (std::uint32_t state = 0; state < opened->states(); ++state)
      CHECK(opened->history(state, place) == double{binout_number(state * per_state, c.variable, c.owner)});
  }
  CHECK(opened->history_series(0).times.empty());  // of d3plot
  const std::uint32_t all = place_of(*opened, "");
  CHECK_THROWS_AS(static_cast<void>(opened->history(0, all)), Error);
  CHECK(std::ranges::count(opened->files(), run.folder / "binout") == 1);
}

TEST_CASE("binout: between its times a history is linear") {
  const HistorySeries series{{0, 1, 3}, {5, 7, 1}};
  CHECK(series.at(-1) == 5);
  CHECK(series.at(0.25) == 5.5);
  CHECK(series.at(1) == 7);
  CHECK(series.at(2) == 4);
  CHECK(series.at(9) == 1);
}

TEST_CASE("binout: a run of several processes, and of files that follow each other") {
  const Run run;
  const std::size_t half = run.binout_states() / 2, rest = run.binout_states() - half;
  BinoutWriter second;  // continues the states of the first
  for (std::size_t s = half; s < half + rest; ++s)
    write_state(second, "/glstat", s, Run::interval() * static_cast<double>(s), {"kinetic_energy", "hourglass_energy"},
                1);
  BinoutWriter of_other_process;
  write_ids(of_other_process, "/rcforc", {1});
  sample_binout(half, Run::interval()).save(run.folder / "binout0000");
  second.save(run.folder / "binout0000%001");
  of_other_process.save(run.folder / "binout0001");
  std::ofstream(run.folder / "binout0000.txt") << "no binout";
  std::ofstream(run.folder / "binout%") << "no binout";
  const auto opened = run.open();
  const HistorySeries series = opened->history_series(place_of(*opened, "glstat.kinetic_energy"));
  CHECK(opened->remark().empty());
  CHECK(opened->files().size() == 4);
  REQUIRE(series.times.size() == run.binout_states());
  CHECK(std::ranges::is_sorted(series.times));
  CHECK(series.values.back() == double{binout_number(run.binout_states() - 1, 0, 0)});
}

TEST_CASE("binout: of an interrupted run, all whole states are there; later ones have no value") {
  const Run run;
  const std::string whole = sample_binout(run.binout_states(), Run::interval()).bytes();
  std::ofstream(run.folder / "binout", std::ios::binary)
      .write(whole.data(), static_cast<std::streamsize>(whole.size() * 5 / 8));
  const auto opened = run.open();
  CHECK(opened->remark().empty());
  const std::uint32_t place = place_of(*opened, "glstat.kinetic_energy");
  const std::size_t states = opened->history_series(place).times.size();
  CHECK(states >= run.binout_states() / 2);
  CHECK(states < run.binout_states());
  CHECK(opened->history(1, place) == double{binout_number(per_state, 0, 0)});
  CHECK(std::isnan(opened->history(3, place)));
}

TEST_CASE("binout: after a restart the states that it computed again count, whatever their numbers") {
  const Run run;
  BinoutWriter first, restarted;
  for (std::size_t s = 0; s < 6; ++s)
    write_state(first, "/glstat", s, 0.25 * static_cast<double>(s), {"kinetic_energy"}, 1);
  for (std::size_t s = 0; s < 4; ++s)
    write_state(restarted, "/glstat", s, 1.0 + 0.25 * static_cast<double>(s), {"kinetic_energy"}, 1);
  first.save(run.folder / "binout0000");
  restarted.save(run.folder / "binout0000%001");
  const auto opened = run.open();
  const HistorySeries series = opened->history_series(place_of(*opened, "glstat.kinetic_energy"));
  CHECK(series.times == std::vector<double>{0, 0.25, 0.5, 0.75, 1, 1.25, 1.5, 1.75});
  CHECK(series.values[3] == double{binout_number(3, 0, 0)});
  CHECK(series.values[4] == double{binout_number(0, 0, 0)});
}

// Regression: one of them was used, which depended on the order of the folder.
TEST_CASE("binout: files of two runs are not used") {
  for (const char* other : {"binout0000", "binout0", "binout0003"}) {
    const Run run;
    for (const std::string& name : {std::string("binout"), std::string(other)})
      sample_binout(run.binout_states(), Run::interval()).save(run.folder / name);
    if (std::string(other) == "binout0") sample_binout(3, 0.5).save(run.folder / "binout00");
    const auto opened = run.open();
    CHECK(of_binout(*opened).empty());
    CHECK_MESSAGE(contains(opened->remark(), "remove the files of an earlier run"), opened->remark());
  }
}

TEST_CASE("binout: directories without end are refused before they fill the memory") {
  const Run run;
  BinoutWriter file;
  for (int i = 0; i < 2000; ++i) file.change_directory("deeper");
  file.save(run.folder / "binout");
  const auto opened = run.open();
  CHECK(of_binout(*opened).empty());
  CHECK(contains(opened->remark(), "name of a directory is longer"));
}

TEST_CASE("binout: a run is read without a damaged one, and says so") {
  const std::string whole = sample_binout(3, 0.5).bytes();
  struct Case {
    std::size_t byte;
    char value;
    const char* sentence;
  };
  for (const Case& c :
       {Case{0, 1, "this is no header"}, Case{1, 0, "this is no header"}, Case{3, 9, "this is no header"},
        Case{5, 0, "not little-endian"}, Case{25, 1, "byte 25: a record of kind"}}) {
    const Run run;
    std::string bytes = whole;
    bytes[c.byte] = c.value;
    for (std::size_t i = 1; i < 8 && c.byte == 25; ++i) bytes[25 + i] = 0;
    std::ofstream(run.folder / "binout", std::ios::binary)
        .write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
    const auto opened = run.open();
    CHECK(opened->states() == 4);
    CHECK(opened->remark().empty());
    CHECK(of_binout(*opened).empty());
    CHECK_MESSAGE(contains(opened->remark(), c.sentence), opened->remark());
    CHECK(contains(opened->remark(), "its binout is not used"));
  }
}
