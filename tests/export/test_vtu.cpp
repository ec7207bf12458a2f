#include "adapters/export/vtu.hpp"
#include "tests/support/files.hpp"
#include "tests/support/refusals.hpp"
#include "tests/support/test_data.hpp"

#include <doctest/doctest.h>
#include <lbea/lbea.hpp>

#include <cstring>
#include <limits>

using namespace lbea;
using namespace lbea::io;
using namespace lbea::test;

namespace {

/// The block of the array `name`, found by its offset, without its length.
template <class T>
std::vector<T> block(const std::string& text, const std::string& name) {
  const std::size_t at = text.find("Name=\"" + name + "\"");
  REQUIRE(at != std::string::npos);
  const std::size_t mark = text.find("<AppendedData encoding=\"raw\">\n_") + 31;
  const std::size_t begin = mark + std::stoul(text.substr(text.find("offset=\"", at) + 8));
  std::uint64_t size = 0;
  REQUIRE(begin + sizeof size <= text.size());
  std::memcpy(&size, text.data() + begin, sizeof size);
  REQUIRE(size <= text.size() - begin - sizeof size);
  std::vector<T> values(size / sizeof(T));
  if (!values.empty()) std::memcpy(values.data(), text.data() + begin + sizeof size, size);
  return values;
}

Status status_of(const VtuGrid& grid) {
  const TemporaryFolder folder;
  const Error error = error_of([&] { write_vtu(folder / "x.vtu", grid); });
  CHECK(std::filesystem::exists(folder / "x.vtu") == (error.status == Status::ok));
  return error.status;
}

const std::vector<float> square{0, 0, 0, 1, 0, 0, 1, 1, 0, 0, 1, 0};
const std::vector<std::uint32_t> quad{0, 1, 2, 3};

}  // namespace

TEST_CASE("blocks stand where the offsets say, for 0, 1, 2 and many cells") {
  for (const std::uint32_t cells : {0u, 1u, 2u, 50'000u}) {
    CAPTURE(cells);
    std::vector<float> positions, strain;
    std::vector<std::uint32_t> nodes, parts;
    for (std::uint32_t i = 0; i < cells + 4; ++i)
      positions.insert(positions.end(), {static_cast<float>(i), 0.5f, -1e-20f});
    std::vector<std::int64_t> corners, ends;
    std::vector<std::uint8_t> types;
    for (std::uint32_t i = 0; i < cells; ++i) {
      const bool triangle = i % 3 == 1;
      nodes.insert(nodes.end(), {i, i + 1, i + 2, triangle ? i + 2 : i + 3});
      for (std::uint32_t k = 0; k < (triangle ? 3u : 4u); ++k) corners.push_back(i + k);
      ends.push_back(static_cast<std::int64_t>(corners.size()));
      types.push_back(triangle ? 5 : 9);
      strain.push_back(static_cast<float>(i) / 7);
      parts.push_back(i % 5);
    }
    const TemporaryFolder folder;
    write_vtu(folder / "x.vtu", {.positions = positions,
                                 .element_nodes = nodes,
                                 .point_arrays = {{"displacement", positions, 3}},
                                 .cell_arrays = {{"strain", strain}, {"part", parts}},
                                 .time_s = {}});
    const std::string text = text_of(folder / "x.vtu");
    CHECK(block<float>(text, "Points") == positions);
    CHECK(block<std::int64_t>(text, "connectivity") == corners);
    CHECK(block<std::int64_t>(text, "offsets") == ends);
    CHECK(block<std::uint8_t>(text, "types") == types);
    CHECK(block<float>(text, "displacement") == positions);
    CHECK(block<float>(text, "strain") == strain);
    CHECK(block<std::uint32_t>(text, "part") == parts);
    CHECK(text.ends_with("\n</AppendedData>\n</VTKFile>\n"));
    CHECK(text.find("NumberOfCells=\"" + std::to_string(cells) + "\"") != std::string::npos);
  }
}

TEST_CASE("what does not fit together is refused and leaves no file") {
  const std::vector<float> one{1}, two{1, 2};
  const auto grid = [&] {
    return VtuGrid{.positions = square, .element_nodes = quad, .point_arrays = {}, .cell_arrays = {}, .time_s = {}};
  };
  CHECK(status_of(grid()) == Status::ok);
  VtuGrid bad = grid();
  bad.positions = bad.positions.first(11);
  CHECK(status_of(bad) == Status::bad_config);
  bad.positions = bad.positions.first(9);  // node 3 is no more
  CHECK(status_of(bad) == Status::bad_config);
  bad = grid();
  bad.element_nodes = bad.element_nodes.first(3);
  CHECK(status_of(bad) == Status::bad_config);
  for (const VtuArray& array :
       {VtuArray{"a", two}, VtuArray{"a", one, 0}, VtuArray{"a", one, 2}, VtuArray{"", one}, VtuArray{"a\nb", one}}) {
    bad = grid();
    bad.cell_arrays = {array};
    CHECK(status_of(bad) == Status::bad_config);
  }
  bad = grid();
  bad.point_arrays = {{"a", one}};
  CHECK(status_of(bad) == Status::bad_config);
}

TEST_CASE("a collection names its files relative to itself, with times that read back exactly") {
  const TemporaryFolder folder;
  const std::vector<PvdEntry> entries{{0.1, folder.path() / "states" / "a<1>.vtu"}, {1.0 / 3, folder / "b.vtu"}};
  write_pvd(folder / "all.pvd", entries);
  const std::string text = text_of(folder / "all.pvd");
  CHECK(text.find("timestep=\"0.1\" part=\"0\" file=\"states/a&lt;1&gt;.vtu\"") != std::string::npos);
  CHECK(text.find("file=\"b.vtu\"") != std::string::npos);
  CHECK(std::stod(text.substr(text.find("timestep=\"0.33") + 10)) == 1.0 / 3);

  write_pvd(folder / "none.pvd", {});
  CHECK(text_of(folder / "none.pvd").find("DataSet") == std::string::npos);
  const std::vector<PvdEntry> endless{{std::numeric_limits<double>::infinity(), folder / "b.vtu"}}, nameless{{0, ""}};
  CHECK_THROWS_AS(write_pvd(folder / "bad.pvd", endless), Error);
  CHECK_THROWS_AS(write_pvd(folder / "bad.pvd", nameless), Error);
  CHECK_FALSE(std::filesystem::exists(folder / "bad.pvd"));
}
