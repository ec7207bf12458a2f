// A database cut at every byte, and with every byte changed: an error in words, or a run that is consistent in itself.
#include <doctest/doctest.h>

#include <fstream>
#include <optional>

#include <lbea/lbea.hpp>

#include "adapters/simulation/open.hpp"
#include "tests/support/d3plot_writer.hpp"
#include "tests/support/refusals.hpp"
#include "tests/support/test_data.hpp"

using lbea::test::D3plot;
using lbea::test::D3plotState;
using lbea::test::sample_d3plot;
namespace fs = std::filesystem;

namespace {

using Bytes = std::vector<std::byte>;

void write(const fs::path& file, const Bytes& bytes) {
  std::ofstream out(file, std::ios::binary | std::ios::trunc);
  out.write(reinterpret_cast<const char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
}

bool is_consistent(lbea::bake::SimulationReader& run) {
  const auto& mesh = run.mesh();
  bool all = !mesh.elements.empty() && mesh.positions.size() == 3 * mesh.nodes();
  for (const auto& element : mesh.elements)
    for (const std::uint32_t node : element) all = all && node < mesh.nodes();
  std::size_t numbers = 0;
  for (const auto& history : run.histories()) numbers += history.size();
  lbea::bake::SimulationState state;
  for (std::uint32_t s = 0; s < run.states(); ++s) {
    for (std::uint32_t place = 0; place < numbers; ++place) static_cast<void>(run.history(s, place));
    run.read(s, state);
    all = all && state.positions.size() == 3 * mesh.nodes() && state.alive.size() == mesh.elements.size() &&
          state.fields.size() == run.fields().size() && (s == 0 || run.time_s(s) >= run.time_s(s - 1));
    for (const auto& field : state.fields) all = all && field.size() == mesh.elements.size();
  }
  return all;
}

/// The number of states, or nothing when the run was refused.
std::optional<std::uint32_t> states_of(const fs::path& file) {
  try {
    const auto run = lbea::io::open_simulation(file);
    REQUIRE(is_consistent(*run));
    return run->states();
  } catch (const lbea::Error& error) {
    REQUIRE(std::string(error.what()).size() > 20);
    REQUIRE((error.status == lbea::Status::bad_input || error.status == lbea::Status::unsupported_input));
    return std::nullopt;
  }
}

D3plot small(std::size_t word_bytes) {
  D3plot d = sample_d3plot(3);
  d.word_bytes = word_bytes;
  d.ndim = 5;
  d.has_extra = d.has_strain = true;
  return d;
}

}  // namespace

TEST_CASE("one file cut at every byte keeps the states before the cut") {
  for (const std::size_t word_bytes : {4u, 8u}) {
    const lbea::test::TemporaryFolder folder;
    const Bytes whole = d3plot_files(small(word_bytes)).front();
    write(folder / "d3plot", whole);
    REQUIRE(states_of(folder / "d3plot") == 3);
    std::optional<std::uint32_t> longer = 3;
    std::size_t refused = 0;
    for (std::size_t length = whole.size(); length-- > 0;) {
      CAPTURE(length);
      fs::resize_file(folder / "d3plot", length);
      const auto states = states_of(folder / "d3plot");
      // fewer and fewer states, then, once the geometry is incomplete, refusals
      REQUIRE((longer ? !states || *states <= *longer : !states));
      if (!states) {
        REQUIRE((!longer || *longer == 0));
        ++refused;
      }
      longer = states;
    }
    CHECK(refused > 64 * word_bytes);
  }
}

TEST_CASE("the last file of a family may be cut, one that others follow may not") {
  D3plot d = small(4);
  d.states_per_file = 2;
  d.states.push_back(d.states.back());
  d.states.back().time = 1;
  const auto files = d3plot_files(d);
  REQUIRE(files.size() == 3);
  const lbea::test::TemporaryFolder folder;
  write_d3plot(d, folder.path());
  for (std::size_t length = files[1].size(); length-- > 0;) {
    CAPTURE(length);
    fs::resize_file(folder / "d3plot01", length);
    const auto states = states_of(folder / "d3plot");
    // cut at a state's border nothing tells that states are missing
    if (states) CHECK((*states == 2 || *states == 3 || *states == 4));
  }
  write(folder / "d3plot01", files[1]);
  for (std::size_t length = files[2].size(); length-- > 0;) {
    fs::resize_file(folder / "d3plot02", length);
    const auto states = states_of(folder / "d3plot");
    REQUIRE(states.has_value());
    CHECK(*states >= 2);
  }
}

TEST_CASE("a family without one of its files, or with an empty one, lost states without a word") {
  D3plot d = sample_d3plot(5);
  d.states_per_file = 1;
  const lbea::test::TemporaryFolder folder;
  const fs::path first = write_d3plot(d, folder.path()), third = folder / "d3plot03";
  const auto refusal = [&] {
    return lbea::test::error_of([&] { static_cast<void>(lbea::io::open_simulation(first)); });
  };
  fs::resize_file(third, 0);
  lbea::test::check_error(refusal(), lbea::Status::bad_input, {"d3plot03", "holds no state, but later files follow"});
  fs::remove(third);
  lbea::test::check_error(refusal(), lbea::Status::bad_input, {"d3plot03 is missing, but d3plot04 is there"});
  fs::remove(folder / "d3plot04");
  fs::remove(folder / "d3plot05");
  CHECK(lbea::io::open_simulation(first)->states() == 2);
}

TEST_CASE("states of a cut or damaged first file were left out without a word") {
  const D3plot whole = small(4);
  const Bytes first = d3plot_files(whole).front();
  D3plot later = small(4);
  later.states_per_file = 1;
  for (D3plotState& state : later.states) state.time += 10;
  const lbea::test::TemporaryFolder folder;
  const fs::path file = write_d3plot(later, folder.path());  // geometry, then a state per file
  REQUIRE(states_of(file) == 3);
  write(file, first);
  REQUIRE(states_of(file) == 6);
  std::size_t refused = 0;
  for (std::size_t length = first.size(); length > first.size() / 2; length -= 16) {
    fs::resize_file(file, length);
    const lbea::Error error = lbea::test::error_of([&] { static_cast<void>(lbea::io::open_simulation(file)); });
    refused +=
        lbea::test::mentions(error, "in the middle of a state") && lbea::test::mentions(error, "later files follow");
  }
  CHECK(refused > 10);
}

TEST_CASE("the hole of a sparse file of 5 TB was read zero by zero, for minutes") {
  const lbea::test::TemporaryFolder folder;
  for (const bool has_end_markers : {true, false}) {
    D3plot d = small(4);
    d.has_end_markers = has_end_markers;
    const fs::path file = write_d3plot(d, folder.path());
    fs::resize_file(file, 5'000'000'000'000);
    CHECK(lbea::io::open_simulation(file)->states() == 3);
  }
}

TEST_CASE("every byte changed, one at a time") {
  for (const std::size_t word_bytes : {4u, 8u}) {
    const lbea::test::TemporaryFolder folder;
    const Bytes whole = d3plot_files(small(word_bytes)).front();
    write(folder / "d3plot", whole);
    std::fstream file(folder / "d3plot", std::ios::binary | std::ios::in | std::ios::out);
    const auto put = [&](std::size_t at, std::byte value) {
      file.seekp(static_cast<std::streamoff>(at));
      file.put(static_cast<char>(value));
      file.flush();
    };
    std::size_t accepted = 0, refused = 0;
    for (std::size_t at = 0; at < whole.size(); ++at) {
      for (const std::byte mask : {std::byte{0x01}, std::byte{0x80}, std::byte{0xff}}) {
        CAPTURE(at);
        put(at, whole[at] ^ mask);
        ++(states_of(folder / "d3plot") ? accepted : refused);
      }
      put(at, whole[at]);
    }
    CHECK(accepted > 0);
    CHECK(refused > 0);
  }
}
