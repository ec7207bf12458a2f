// VTKHDF files made by tests/data/simulation/write_vtkhdf.py: grids and polygons, in parts, over time, and damaged.
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <cstring>

#include "tests/simulation/sample_grid.hpp"
#include "tests/support/files.hpp"
#include "tests/support/refusals.hpp"
#include "tests/support/test_data.hpp"

using namespace lbea;
using namespace lbea::bake;
using namespace lbea::io;
using namespace lbea::test;

namespace {
namespace fs = std::filesystem;

fs::path folder() { return data() / "simulation" / "vtkhdf"; }
}  // namespace

TEST_CASE("grids and polygons, in one part and in two, are the grid that VTK's other formats have") {
  for (const char* name : {"sample_grid", "sample_grid_parts", "sample_polygons", "sample_polygons_parts"}) {
    CAPTURE(name);
    check_sample_grid(folder() / (std::string(name) + ".vtkhdf"));
  }
}

TEST_CASE("steps are states, whether arrays are stored for each step or once") {
  for (const char* name : {"moving_grid", "moving_grid_repeated", "moving_polygons", "moving_polygons_repeated"}) {
    CAPTURE(name);
    const fs::path file = folder() / (std::string(name) + ".vtkhdf");
    const auto run = open_simulation(file);
    CHECK(run->files() == std::vector<fs::path>{file});
    CHECK(run->mesh().node_ids == std::vector<std::uint32_t>{11, 12, 13, 14, 15, 16, 17, 18});
    REQUIRE(run->mesh().elements.size() == 3);
    CHECK(run->mesh().elements[2] == Quad{4, 6, 7, 5});
    REQUIRE(run->states() == 3);
    const std::array times{0.0, 0.5, 2.0};
    for (const std::uint32_t step : {2u, 0u, 1u}) {
      CAPTURE(step);
      CHECK(run->time_s(step) == times[step]);
      SimulationState state;
      run->read(step, state);
      for (std::size_t node = 0; node < 8; ++node) {
        const auto x = static_cast<float>(node / 2);
        CHECK(state.positions[3 * node] == x);
        CHECK(state.positions[3 * node + 2] == static_cast<float>(step) * x * x);
      }
      REQUIRE(state.fields.size() == 1);
      for (std::size_t e = 0; e < 3; ++e)
        CHECK(state.fields[0][e] == static_cast<float>(step) + 0.25f * static_cast<float>(e));
    }
  }
}

TEST_CASE("what is wrong with VTKHDF files is said") {
  const auto refused = [](const std::string& name, const std::vector<std::string>& words,
                          Status status = Status::bad_input) {
    CAPTURE(name);
    const fs::path file = folder() / "refused" / (name + ".vtkhdf");
    const Error error = error_of([&] { static_cast<void>(open_simulation(file)); });
    check_error(error, status, words);
    CHECK(mentions(error, name + ".vtkhdf"));
  };
  refused("other", {"no group VTKHDF"}, Status::unsupported_input);
  refused("image", {"holds a ImageData"}, Status::unsupported_input);
  refused("version", {"version 3"}, Status::unsupported_input);
  refused("missing", {"no dataset \"VTKHDF/Types\""});
  refused("short", {"\"VTKHDF/Points\" has 3 rows, but 4 from row 0"});
  refused("flat", {"\"VTKHDF/Points\" has not three columns"});
  refused("negative", {"\"VTKHDF/NumberOfCells\" has a negative"});
  refused("decreasing", {"\"VTKHDF/Offsets\" decreases"});
  refused("beyond", {"part 0, cell 0: names point 3"});
  refused("declared", {"\"VTKHDF/Points\" declares", "more than it stores"});
  refused("texts", {"\"VTKHDF/Points\" does not hold numbers"}, Status::unsupported_input);
  refused("tensors", {"\"VTKHDF/CellData/tensor\" has 3 dimensions"}, Status::unsupported_input);
  refused("packed", {"\"VTKHDF/Points\" is compressed by filter 32000"}, Status::unsupported_input);
  refused("elsewhere", {"\"VTKHDF/PointData\" is a link"}, Status::unsupported_input);
  refused("outside", {"\"VTKHDF/CellData/a\" is stored in other files"}, Status::unsupported_input);
}

TEST_CASE("times of steps that decrease or are no numbers are refused") {
  const TemporaryFolder scratch;
  const std::string whole = text_of(folder() / "moving_grid.vtkhdf");
  const std::array times{0.0, 0.5, 2.0};
  std::string stored(sizeof(times), '\0');
  std::memcpy(stored.data(), times.data(), sizeof(times));
  const std::size_t place = whole.find(stored);
  REQUIRE(place < whole.size());
  const auto refused = [&](double second, const std::vector<std::string>& words) {
    std::string bytes = whole;
    std::memcpy(bytes.data() + place + sizeof(double), &second, sizeof(double));
    const fs::path file = put(scratch / "times.vtkhdf", bytes);
    check_error(error_of([&] { static_cast<void>(open_simulation(file)); }), Status::bad_input, words);
  };
  refused(3, {"times.vtkhdf, step 2: its time 2.0", "previous step; export the steps in the order of time"});
  refused(NAN, {"times.vtkhdf, step 1: its time is not a number"});
}

TEST_CASE("VTKHDF files that are cut short are refused") {
  const TemporaryFolder scratch;
  const std::string whole = text_of(folder() / "moving_grid.vtkhdf");
  for (std::size_t length = 8; length < whole.size(); length += 501) {
    CAPTURE(length);
    const fs::path file = put(scratch / "cut.vtkhdf", whole.substr(0, length));
    check_error(error_of([&] { static_cast<void>(open_simulation(file)); }), Status::bad_input,
                {"cut.vtkhdf", "(HDF5)"});
  }
}

TEST_CASE("files on which libhdf5 1.10 crashes or never ends are refused, and the program goes on") {
  const TemporaryFolder scratch;
  std::string bytes = text_of(folder() / "moving_grid.vtkhdf");
  const std::size_t size_of_text = bytes.find("GCOL") + 24;  // in the heap of texts of variable length
  REQUIRE(size_of_text < bytes.size());
  for (const auto& damage : {std::pair(1, '\x7f'), {0, '\1'}}) {
    CAPTURE(damage.first);
    std::string damaged = bytes;
    damaged[size_of_text + static_cast<std::size_t>(damage.first)] = damage.second;
    const fs::path file = put(scratch / "damaged.vtkhdf", damaged);
    check_error(error_of([&] { static_cast<void>(open_simulation(file)); }), Status::bad_input,
                {"damaged.vtkhdf: libhdf5 fails to read it"});
  }
}
