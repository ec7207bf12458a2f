#include "precompute/model_file/model_writer.hpp"

#include "runtime/src/model/section_reader.hpp"
#include "tests/support/files.hpp"
#include "tests/support/refusals.hpp"
#include "tests/support/synthetic_model.hpp"

#include <doctest/doctest.h>

#include <sys/stat.h>

#include <algorithm>
#include <numeric>
#include <random>
#include <stdexcept>
#include <thread>

using namespace lbea;
using namespace lbea::bake;
using namespace lbea::test;
using format::ElementType;
using format::SectionId;

namespace {

constexpr std::size_t rows = 300, columns = 7;

std::vector<PlannedSection> small_plan() {
  return {{SectionId::node_positions, 0, ElementType::f32, {rows, columns, 1}},
          {SectionId::info, 0, ElementType::u32, {3}},
          {SectionId::parameter_names, 0, ElementType::u8, {0}},
          {SectionId::mass, 1, ElementType::f64, {1}},
          {SectionId::mass, 0, ElementType::f64, {1}}};
}

std::vector<float> row(std::size_t i) {
  std::vector<float> values(columns);
  std::iota(values.begin(), values.end(), static_cast<float>(i * columns));
  return values;
}

/// Writes all of small_plan(), the rows in a shuffled order from `threads` threads.
void write_small(const std::filesystem::path& file, unsigned threads, std::uint32_t seed) {
  ModelWriter writer(file, small_plan());
  std::vector<std::size_t> order(rows);
  std::iota(order.begin(), order.end(), 0u);
  std::shuffle(order.begin(), order.end(), std::mt19937(seed));
  {
    std::vector<std::jthread> workers;
    for (unsigned worker = 0; worker < threads; ++worker)
      workers.emplace_back([&, worker] {
        for (std::size_t i = worker; i < rows; i += threads)
          writer.write<float>(SectionId::node_positions, 0, order[i] * columns, row(order[i]));
      });
  }
  writer.write<double>(SectionId::mass, 1, 0, std::array{2.5});
  writer.write<double>(SectionId::mass, 0, 0, std::array{1.5});
  writer.write<std::uint32_t>(SectionId::info, 0, 0, std::array{1u, 2u, 3u});
  writer.commit();
}

}  // namespace

TEST_CASE("the runtime reads the written model") {
  const TemporaryFolder folder;
  write_small(folder / "m.lbea", 1, 1);
  const AlignedBytes bytes(folder / "m.lbea");
  const SectionReader reader(bytes.span(), "m.lbea");
  CHECK(reader.entries().size() == 5);
  CHECK(std::ranges::equal(reader.required<std::uint32_t>(SectionId::info, {3, 1, 1}), std::array{1u, 2u, 3u}));
  CHECK(reader.required<double>(SectionId::mass, {1, 1, 1}, 1)[0] == 2.5);
  CHECK(reader.required<double>(SectionId::mass, {1, 1, 1}, 0)[0] == 1.5);
  CHECK(reader.text(SectionId::parameter_names).empty());
  const auto positions = reader.required<float>(SectionId::node_positions, {rows, columns, 1});
  for (std::size_t i = 0; i < positions.size(); ++i) REQUIRE(positions[i] == static_cast<float>(i));
  CHECK(files_in(folder.path()) == 1);
}

TEST_CASE("the bytes do not depend on order or threads") {
  const TemporaryFolder folder;
  write_small(folder / "a", 1, 1);
  for (const unsigned threads : {1u, 2u, 4u}) {
    write_small(folder / "b", threads, threads + 1);
    CHECK(text_of(folder / "a") == text_of(folder / "b"));
  }
}

TEST_CASE("without commit no file is left, and an existing one stays") {
  const TemporaryFolder folder;
  write_small(folder / "m.lbea", 1, 1);
  const auto before = text_of(folder / "m.lbea");
  { ModelWriter writer(folder / "m.lbea", small_plan()); }
  CHECK(files_in(folder.path()) == 1);
  CHECK(text_of(folder / "m.lbea") == before);
  write_small(folder / "m.lbea", 1, 1);  // a model may take the place of a model
  std::ofstream(folder / "empty").flush();
  write_small(folder / "empty", 1, 1);  // or of nothing
  CHECK(text_of(folder / "empty") == before);
}

// "-o ensemble.toml" once replaced the ensemble's own description by the model, and "-o /dev/null" the device.
TEST_CASE("a file that is not a model is never overwritten; links are resolved") {
  const TemporaryFolder folder;
  std::ofstream(folder / "ensemble.toml") << "runs = [\"runs/*\"]";
  CHECK_THROWS_WITH_AS(write_small(folder / "ensemble.toml", 1, 1), doctest::Contains("is not a model"), Error);
  CHECK(std::filesystem::file_size(folder / "ensemble.toml") == 17);
  REQUIRE(::mkfifo((folder / "pipe").c_str(), 0600) == 0);  // stands for the device
  CHECK_THROWS_WITH_AS(write_small(folder / "pipe", 1, 1), doctest::Contains("is not a model"), Error);
  CHECK(std::filesystem::is_fifo(folder / "pipe"));
  write_small(folder / "real.lbea", 1, 1);
  std::filesystem::create_symlink(folder / "real.lbea", folder / "link.lbea");
  write_small(folder / "link.lbea", 1, 1);
  CHECK(std::filesystem::is_symlink(folder / "link.lbea"));
  CHECK(files_in(folder.path()) == 4);
}

TEST_CASE("a full disk is detected before the work and named, and nothing is left") {
  const TemporaryFolder folder;
  const FullDisk disk(4096);
  CHECK_THROWS_WITH_AS(write_small(folder / "m.lbea", 1, 1), doctest::Contains("cannot reserve space for"), Error);
  CHECK(files_in(folder.path()) == 0);
}

TEST_CASE("the error about a failed write names file, section and reason, and nothing is left") {
  const TemporaryFolder folder;
  {
    ModelWriter writer(folder / "m.lbea", small_plan());
    const FullDisk disk(1024);
    writer.write<std::uint32_t>(SectionId::info, 0, 0, std::array{1u, 2u, 3u});  // still fits
    check_error(error_of([&] { writer.write<float>(SectionId::node_positions, 0, rows * columns - columns, row(0)); }),
                Status::write_failed, {"m.lbea", "section 13 'node_positions'", "File too large"});
  }
  CHECK(files_in(folder.path()) == 0);
}

TEST_CASE("a missing folder, and a folder under the file's name, are refused") {
  const TemporaryFolder folder;
  CHECK_THROWS_WITH_AS(write_small(folder.path() / "none" / "m.lbea", 1, 1), doctest::Contains("cannot create"), Error);
  std::filesystem::create_directory(folder / "taken");
  CHECK_THROWS_WITH_AS(write_small(folder / "taken", 1, 1), doctest::Contains("is not a model"), Error);
  CHECK(files_in(folder.path()) == 1);
}

TEST_CASE("writing an unplanned section is a logic error") {
  const TemporaryFolder folder;
  ModelWriter writer(folder / "m.lbea", small_plan());
  CHECK_THROWS_AS(writer.write<double>(SectionId::mass, 2, 0, std::array{1.0}), std::logic_error);
  CHECK_THROWS_AS(writer.write<double>(SectionId::mass, 0, 1, std::array{1.0}), std::logic_error);
  CHECK_THROWS_AS(writer.write<double>(SectionId::mass, 0, ~std::uint64_t{0} / 8, std::array{1.0}), std::logic_error);
  CHECK_THROWS_WITH_AS(writer.commit(), doctest::Contains("section 1 'info' part 0: 0 of 12 bytes"), std::logic_error);
  auto twice = small_plan();
  twice.push_back(twice.front());
  CHECK_THROWS_AS(ModelWriter(folder / "n.lbea", twice), std::logic_error);
}

TEST_CASE("sizes beyond any disk are refused before they overflow") {
  const TemporaryFolder folder;
  const std::uint64_t huge = std::uint64_t{1} << 32;
  CHECK_THROWS_WITH_AS(ModelWriter(folder / "m.lbea", {{SectionId::correspondence, 0, ElementType::u32, {huge, huge}}}),
                       doctest::Contains("larger than any disk"), Error);
  CHECK(files_in(folder.path()) == 0);
}
