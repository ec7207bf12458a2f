// Databases that cannot be used are refused in a sentence that names file, byte and what to do.
#include <doctest/doctest.h>

#include <fstream>
#include <functional>
#include <limits>

#include <lbea/lbea.hpp>

#include "adapters/simulation/open.hpp"
#include "tests/support/d3plot_writer.hpp"
#include "tests/support/refusals.hpp"
#include "tests/support/test_data.hpp"

using lbea::Error;
using lbea::Status;
using lbea::test::D3plot;
using lbea::test::sample_d3plot;
namespace fs = std::filesystem;

namespace {

Error refusal(const fs::path& path) {
  return lbea::test::error_of([&] { static_cast<void>(lbea::io::open_simulation(path)); });
}

/// With the file's name, and what to do after a semicolon.
void check(const Error& found, Status status, const std::string& words) {
  lbea::test::check_error(found, status, {words, "d3plot", "; "});
}

void check_written(const std::function<void(D3plot&)>& change, Status status, const std::string& words) {
  const lbea::test::TemporaryFolder folder;
  D3plot d = sample_d3plot(2);
  change(d);
  const Error found = refusal(write_d3plot(d, folder.path()));
  check(found, status, words);
  CHECK(lbea::test::mentions(found, "byte "));
}

std::function<void(D3plot&)> control(std::size_t word, std::int64_t value) {
  return [=](D3plot& d) { d.overrides[word] = value; };
}

}  // namespace

TEST_CASE("kinds of databases that are not read") {
  const Status no = Status::unsupported_input;
  check_written([](D3plot& d) { d.is_big_endian = true; }, no, "big-endian");
  check_written([](D3plot& d) { d.is_big_endian = true, d.word_bytes = 8; }, no, "big-endian");
  check_written(control(51, 76'893'465), no, "FEMZIP");
  check_written(control(11, 11), no, "eigenvectors");
  check_written(control(11, 1001), no, "8-byte ids");
  check_written(control(11, 4), no, "none of the supported formats");
  check_written(control(15, 2), no, "two-dimensional");
  check_written(control(15, 8), no, "NDIM");
  check_written(control(23, -3), no, "ten-node");
  check_written(control(37, 5), no, "particles");
  check_written(control(54, 1), no, "particles");
  check_written(control(48, 67'108'864), no, "fluid");
  check_written(control(50, 1), no, "adaptive");
  check_written([](D3plot& d) { d.extra_words = 64, d.overrides[78] = 1; }, no, "penetration");
  check_written([](D3plot& d) { d.iu = 0; }, no, "IU = 0");
  check_written([](D3plot& d) { d.shells.clear(), d.solids.clear(), d.beams = 2, fill_states(d, 2); }, no, "surface");
}

TEST_CASE("control words that contradict the file") {
  const Status bad = Status::bad_input;
  check_written(control(16, -1), bad, "NUMNP is -1");
  check_written(control(16, 2'000'000'000), bad, "NUMNP");
  check_written(control(31, 1'000), bad, "connectivity of shells");
  check_written(control(57, 100'000), bad, "EXTRA");
  check_written(control(39, 20), bad, "numbering block");
  check_written(control(36, -10'009), bad, "NV2D");
  for (const std::size_t states_per_file : {0u, 1u, 2u})
    for (const std::int64_t words : {3, 40, 1'000'000}) {  // states seem too long: nothing lines up
      CAPTURE(states_per_file);
      CAPTURE(words);
      check_written([&](D3plot& d) { d.states_per_file = states_per_file, d.overrides[33] = words; }, bad, "state");
    }
  check_written([](D3plot& d) { d.word_bytes = 8, d.overrides[31] = std::int64_t{1} << 62; }, bad, "NEL4");
  check_written([](D3plot& d) { d.shells[0][0] = 99'999; }, bad, "node 100000");
  check_written([](D3plot& d) { d.shell_parts[2] = 0; }, bad, "part 0");
  check_written([](D3plot& d) { d.node_ids[3] = -7; }, bad, "-7");
}

TEST_CASE("rigid shells that the material types do not confirm") {
  const lbea::test::TemporaryFolder folder;
  D3plot d = sample_d3plot(2);
  d.ndim = 5;
  const fs::path file = write_d3plot(d, folder.path());
  std::fstream out(file, std::ios::binary | std::ios::in | std::ios::out);
  out.seekp(64 * 4);  // NUMRBE is the word after the control words
  out.put(3);
  out.close();
  check(refusal(file), Status::bad_input, "3 rigid shells");
}

TEST_CASE("every shell degenerate") {
  check_written(
      [](D3plot& d) {
        d.solids.clear(), d.shells = {{0, 0, 1, 1}, {2, 3, 2, 3}}, fill_states(d, 2);
      },
      Status::bad_input, "degenerate");
}

TEST_CASE("times that run backwards: files of two runs in one folder") {
  check_written([](D3plot& d) { d.states_per_file = 1, d.states[1].time = -1; }, Status::bad_input, "two runs");
  check_written([](D3plot& d) { d.states_per_file = 1, d.states[1].time = std::numeric_limits<double>::quiet_NaN(); },
                Status::bad_input, "two runs");
}

TEST_CASE("paths that are not the first file of a run") {
  const lbea::test::TemporaryFolder folder;
  check(refusal(folder / "d3plot"), Status::file_not_found, "No such file");
  check(refusal(folder.path()), Status::file_not_found, "holds no file named d3plot");
  std::ofstream(folder / "d3plot");
  check(refusal(folder / "d3plot"), Status::unsupported_input, "none of the supported formats");
  fs::create_directories(folder / "nested/d3plot");
  check(refusal(folder / "nested"), Status::bad_input, "not a regular file");
  CHECK_THROWS_AS(static_cast<void>(lbea::io::open_d3plot(folder / "d3plot")), lbea::Error);

  D3plot d = sample_d3plot(2);
  d.states_per_file = 1;
  write_d3plot(d, folder.path());
  CHECK_THROWS_WITH_AS(static_cast<void>(lbea::io::open_d3plot(folder / "d3plot01")),
                       doctest::Contains("give its first file, d3plot"), lbea::Error);
  write_d3plot(d, folder.path(), "d3plot07");  // a first file of its own, whatever its name
  CHECK(lbea::io::open_d3plot(folder / "d3plot07")->states() == 2);
  fs::remove(folder / "d3plot07");
  std::ofstream(folder / "d3plotaa");
  check(refusal(folder / "d3plot"), Status::unsupported_input, "adaptive");
}

TEST_CASE("a state that does not exist, a file that shrank since") {
  const lbea::test::TemporaryFolder folder;
  D3plot d = sample_d3plot(2);
  d.states_per_file = 1;
  const auto run = lbea::io::open_simulation(write_d3plot(d, folder.path()));
  lbea::bake::SimulationState state;
  CHECK_THROWS_WITH_AS(run->read(2, state), doctest::Contains("state 2 does not exist"), lbea::Error);
  CHECK_THROWS_AS(static_cast<void>(run->time_s(2)), lbea::Error);
  fs::resize_file(folder / "d3plot02", 100);
  CHECK_THROWS_WITH_AS(run->read(1, state), doctest::Contains("cut short"), lbea::Error);
  run->read(0, state);
  CHECK(state.alive.size() == run->mesh().elements.size());
}
