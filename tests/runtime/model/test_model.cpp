#include "tests/runtime/model/forged_model.hpp"
#include "tests/support/files.hpp"
#include "tests/support/synthetic_model.hpp"

#include <doctest/doctest.h>

#include <cstdlib>
#include <cstring>
#include <limits>
#include <random>

using namespace lbea;
using namespace lbea::bake;
using namespace lbea::test;

namespace {

// The smallest model worth damaging.
AlignedBytes small_model() {
  return bent_plates_model(ReferenceMode::impact, {.runs = 2, .steps = 2, .shape = {.columns = 6, .rows = 5}});
}

}  // namespace

TEST_CASE("what the model says of itself") {
  const AlignedBytes bytes = small_model();
  const Model model = Model::view(bytes.span());
  CHECK(model.simulations() == 2);
  CHECK(model.samples() == 4);
  CHECK(model.simulation_name(1) == "plate_1");
  CHECK(model.parameters() == 1);
  CHECK(model.parameter_name(0) == "final_angle [rad]");
  CHECK(model.parameter(1, 0) == doctest::Approx(1.17));
  CHECK(model.length_unit() == "mm");
  CHECK(model.sample(3) == Sample{1, 1});
  CHECK(model.sample_index({1, 0}) == 2);
  CHECK(model.sample_index({1, 7}) == model.samples());
  CHECK(model.sample_index({9, 0}) == model.samples());
  CHECK(model.nodes() == 30);
  CHECK(model.elements() == 20);
  CHECK(model.element_nodes().size() == 80);
  CHECK(model.node_ids()[0] == 1001);
  CHECK(model.eigenvalues(0).size() == model.modes());
  CHECK(model.provenance().front() == '{');
}

TEST_CASE("a model cut at any byte is refused") {
  const AlignedBytes bytes = small_model();
  const bool all = std::getenv("LBEA_LONG_TESTS") != nullptr;
  for (std::size_t size = 0; size < bytes.span().size(); size += all || size < 4'096 ? 1 : 61) {
    CAPTURE(size);
    REQUIRE(is_refusal(status_of(bytes.span().first(size))));
  }
}

TEST_CASE("every flipped bit is refused") {
  AlignedBytes bytes = small_model();
  const auto image = bytes.span();
  const std::size_t bits = image.size() * 8;
  // All bits of header and directory, and a stride through the rest that meets every bit position; all in the long run.
  const bool all = std::getenv("LBEA_LONG_TESTS") != nullptr;
  for (std::size_t bit = 0; bit < bits; bit += (all || bit < 8 * 4'096) ? 1 : 97) {
    image[bit / 8] ^= std::byte{1} << (bit % 8);
    CAPTURE(bit);
    REQUIRE(is_refusal(status_of(image)));
    image[bit / 8] ^= std::byte{1} << (bit % 8);
  }
  CHECK(status_of(image) == Status::ok);
}

TEST_CASE("headers that pass their checksum are still not believed") {
  AlignedBytes bytes = small_model();
  const auto image = bytes.span();
  const format::Header good = header_of(image);
  const auto with = [&](auto change) {
    format::Header header = good;
    change(header);
    put_header(image, header);
    return status_of(image);
  };
  CHECK(with([](auto& h) { h.version_major = 2; }) == Status::unsupported_version);
  CHECK(with([](auto& h) { h.version_minor = 9; }) == Status::ok);
  CHECK(with([](auto& h) { h.endian_tag = 0x04030201; }) == Status::corrupt_model);
  CHECK(with([](auto& h) { h.file_size += 64; }) == Status::corrupt_model);
  CHECK(with([](auto& h) { h.directory_offset = 128; }) == Status::corrupt_model);
  CHECK(with([](auto& h) { h.section_count = 0xffff'ffff; }) == Status::corrupt_model);
  CHECK(with([](auto& h) { h.section_count -= 1; }) == Status::corrupt_model);
  CHECK(with([](auto& h) { h.section_count = 0; }) == Status::corrupt_model);
  CHECK(with([](auto& h) { h.reserved1 = 1; }) == Status::corrupt_model);
  CHECK(with([](auto&) {}) == Status::ok);
}

namespace {

/// Its checksum is that of before.
Status status_with_unknown_section_changed(AlignedBytes bytes) {
  std::uint64_t place = 0;
  forge(bytes.span(), format::SectionId::correspondence, [&](format::SectionEntry& entry, auto) {
    entry.id = 0x9000;
    place = entry.offset;
  });
  REQUIRE(status_of(bytes.span()) == Status::ok);
  bytes.span()[place] ^= std::byte{1};
  return status_of(bytes.span());
}

}  // namespace

TEST_CASE("directories and sections with fitting checksums are still not believed") {
  using format::SectionId;
  const AlignedBytes original = small_model();
  const auto forged = [&](SectionId id, auto change) {
    AlignedBytes bytes = original;
    forge(bytes.span(), id, change);
    return status_of(bytes.span());
  };
  const auto entry = [&](SectionId id, auto change) {
    return forged(id, [&](format::SectionEntry& e, std::span<std::byte>) { change(e); });
  };
  const auto content = [&]<typename T>(SectionId id, std::size_t index, T value) {
    return forged(id, [&](format::SectionEntry&, std::span<std::byte> section) { set(section, index, value); });
  };
  CHECK(entry(SectionId::mass, [](auto&) {}) == Status::ok);

  CHECK(entry(SectionId::mass, [](auto& e) { e.offset += 64; }) == Status::corrupt_model);
  CHECK(entry(SectionId::mass, [](auto& e) { e.length -= 8; }) == Status::corrupt_model);
  CHECK(entry(SectionId::mass, [](auto& e) { e.shape[0] = 1ull << 61; }) == Status::corrupt_model);
  CHECK(entry(SectionId::mass, [](auto& e) { e.shape = {1ull << 32, 1ull << 32, 1}; }) == Status::corrupt_model);
  CHECK(entry(SectionId::mass, [](auto& e) { e.element_type = 9; }) == Status::corrupt_model);
  CHECK(entry(SectionId::mass, [](auto& e) { e.rank = 0; }) == Status::corrupt_model);
  CHECK(entry(SectionId::mass, [](auto& e) { e.id = 31; }) == Status::corrupt_model);  // then out of order
  CHECK(entry(SectionId::correspondence, [](auto& e) { e.id = 99; }) == Status::unsupported_version);
  CHECK(entry(SectionId::correspondence, [](auto& e) { e.id = 0x9000; }) == Status::ok);  // optional, unknown: ignored
  CHECK(status_with_unknown_section_changed(original) == Status::corrupt_model);

  constexpr std::uint32_t huge = 0xffff'ffff;
  const float infinity = std::numeric_limits<float>::infinity();
  for (std::size_t word = 0; word < sizeof(format::Info) / 4; ++word) {
    CAPTURE(word);
    if (word != 13) CHECK(content(SectionId::info, word, huge) == Status::corrupt_model);
    if (word != 0 && word != 8 && word != 9 && word != 13)
      CHECK(content(SectionId::info, word, 0u) == Status::corrupt_model);
  }
  CHECK(content(SectionId::samples, 6, 0u) == Status::corrupt_model);  // not ascending any more
  CHECK(content(SectionId::samples, 6, 5u) == Status::corrupt_model);  // a simulation that does not exist
  CHECK(content(SectionId::element_nodes, 3, 30u) == Status::corrupt_model);
  CHECK(content(SectionId::vertex_nodes, 0, huge) == Status::corrupt_model);
  CHECK(content(SectionId::correspondence, 5, 30u) == Status::corrupt_model);
  CHECK(content(SectionId::node_positions, 4, infinity) == Status::corrupt_model);
  CHECK(content(SectionId::coefficients, 0, std::nanf("")) == Status::corrupt_model);
  CHECK(content(SectionId::projection, 0, infinity) == Status::corrupt_model);
  for (const SectionId id : {SectionId::node_positions, SectionId::coefficients, SectionId::projection,
                             SectionId::vertex_positions, SectionId::envelope_grid})
    CHECK(content(id, 0, 1e13f) == Status::corrupt_model);  // its square's sum would be no number any more
  CHECK(content(SectionId::envelope_grid, 3, 0.0f) == Status::corrupt_model);
  CHECK(content(SectionId::envelope_grid, 3, -1.0f) == Status::corrupt_model);
  for (const double mass : {0.0, -1.0, double{infinity}, std::nan("")})  // the coverage was no number, its status ok
    CHECK(content(SectionId::mass, 0, mass) == Status::corrupt_model);
  CHECK(content(SectionId::eigenvalues, 0, std::nan("")) == Status::corrupt_model);
  CHECK(content(SectionId::simulation_names, 7, 'x') ==
        Status::corrupt_model);  // one string becomes longer, one is missing
  for (std::size_t word = 0; word < 3; ++word)
    CHECK(content(SectionId::tree_ranges, word, huge) == Status::corrupt_model);
  CHECK(content(SectionId::tree_ranges, 2, 0u) == Status::corrupt_model);
  CHECK(content(SectionId::tree_ranges, 1, 1u) == Status::corrupt_model);
  CHECK(content(SectionId::tree_boxes, 0, 1e30f) == Status::corrupt_model);
}

TEST_CASE("fields in 16 bits: damaged in any bit, or forged with fitting checksums, they are refused") {
  using format::SectionId;
  const TemporaryFolder folder;
  EnsembleDescription description = bent_plates_description();
  description.compact_fields = true;
  bake_model(bent_plates({.runs = 2, .steps = 2, .shape = {.columns = 6, .rows = 5}}), description, folder / "m.lbea");
  const AlignedBytes original(folder / "m.lbea");
  const auto forged = [&](SectionId id, auto change) {
    AlignedBytes bytes = original;
    forge(bytes.span(), id, change);
    return status_of(bytes.span());
  };
  const auto range = [&](std::size_t word, float value) {
    return forged(SectionId::field_ranges,
                  [&](format::SectionEntry&, std::span<std::byte> section) { set(section, word, value); });
  };
  REQUIRE(forged(SectionId::field_ranges, [](auto&, auto) {}) == Status::ok);
  const float infinity = std::numeric_limits<float>::infinity();
  for (std::size_t word = 0; word < 12; ++word)
    for (const float value : {infinity, -infinity, std::nanf(""), -1e30f, 1e30f}) {
      CAPTURE(word);
      CAPTURE(value);
      CHECK(range(word, value) == Status::corrupt_model);
    }
  // Every code means something.
  CHECK(forged(SectionId::field_codes,
               [](auto&, std::span<std::byte> section) { std::ranges::fill(section, std::byte{0xff}); }) == Status::ok);
  CHECK(forged(SectionId::field_codes, [](auto& e, auto) { e.part = 1; }) == Status::corrupt_model);
  CHECK(forged(SectionId::field_ranges, [](auto& e, auto) { e.part = 1; }) == Status::corrupt_model);
  CHECK(forged(SectionId::field_codes, [](auto& e, auto) {
          e.shape = {1, e.shape[0] * e.shape[1], 1};
        }) == Status::corrupt_model);
  AlignedBytes bytes = original;
  const std::size_t bits = bytes.span().size() * 8;
  for (std::size_t bit = 0; bit < bits; bit += std::getenv("LBEA_LONG_TESTS") != nullptr ? 1u : 101u) {
    bytes.span()[bit / 8] ^= std::byte{1} << (bit % 8);
    CAPTURE(bit);
    REQUIRE(is_refusal(status_of(bytes.span())));
    bytes.span()[bit / 8] ^= std::byte{1} << (bit % 8);
  }
}

TEST_CASE("the models that fuzzing begins with are models") {
  std::size_t models = 0;
  for (const auto& entry : std::filesystem::directory_iterator(data() / "fuzz" / "model")) {
    CAPTURE(entry.path().string());
    CHECK(Model::open(entry.path()).samples() == 4);
    ++models;
  }
  CHECK(models >= 3);
}

TEST_CASE("other files are not models") {
  const TemporaryFolder folder;
  CHECK_THROWS_AS(Model::open(folder / "absent.lbea"), Error);
  const auto status_of_file = [&](const std::string& content) {
    const Error error = error_of([&] { Model::open(put(folder / "file", content)); });
    CHECK(mentions(error, "file"));
    return error.status;
  };
  CHECK(status_of_file("") == Status::not_a_model);
  CHECK(status_of_file("\x89LBEA\r\n") == Status::not_a_model);
  CHECK(status_of_file("\x89LBEA\r\n\x1a") == Status::corrupt_model);
  CHECK(status_of_file("\x89LBEA\n\x1a and a text-mode copy") == Status::not_a_model);
  CHECK(status_of_file(std::string(10'000, 'x')) == Status::not_a_model);
  CHECK(error_of([&] { Model::open(folder.path()); }).status == Status::not_a_model);
}

TEST_CASE("a model outlives the variable it was opened in, and the file's name") {
  const TemporaryFolder folder;
  bake_bent_plates(folder / "plates.lbea");
  auto opened = std::make_unique<Model>(Model::open(folder / "plates.lbea"));
  const Model copy = *opened;
  opened.reset();
  std::filesystem::remove(folder / "plates.lbea");
  CHECK(copy.simulation_name(3) == "plate_3");
}
