// Sections that not every model has, and what they must not hold.
#include "tests/runtime/fit/seen_plates.hpp"
#include "tests/runtime/model/forged_model.hpp"
#include "tests/support/synthetic_model.hpp"

#include <doctest/doctest.h>

#include <cmath>
#include <limits>
#include <memory>

using namespace lbea;
using namespace lbea::bake;
using namespace lbea::test;
using format::SectionId;

namespace {

constexpr BentPlates small{.runs = 2, .steps = 2, .shape = {.columns = 6, .rows = 5}};
constexpr float infinity = std::numeric_limits<float>::infinity();

AlignedBytes baked(void (*change)(EnsembleDescription&)) {
  const TemporaryFolder folder;
  EnsembleDescription description = bent_plates_description();
  change(description);
  bake_model(bent_plates(small), description, folder / "m.lbea");
  return AlignedBytes(folder / "m.lbea");
}

template <typename T>
Status status_with(AlignedBytes bytes, SectionId id, std::size_t index, T value) {
  forge(bytes.span(), id, [&](format::SectionEntry&, std::span<std::byte> section) { set(section, index, value); });
  return status_of(bytes.span());
}

}  // namespace

TEST_CASE("views: cameras and expectations that cannot be are refused") {
  const AlignedBytes views(data() / "fuzz" / "model" / "views.lbea");
  REQUIRE(status_of(views.span()) == Status::ok);
  for (const std::uint32_t cells : {0u, 16'385u, 0xffff'ffffu})
    for (const std::size_t axis : {0u, 1u})
      CHECK(status_with(views, SectionId::view_size, axis, cells) == Status::corrupt_model);
  for (std::size_t word = 0; word < format::depth_camera_words_1_0; ++word) {  // the file is of version 1.0
    CAPTURE(word);
    CHECK(status_with(views, SectionId::view_camera, word, double{infinity}) == Status::corrupt_model);
  }
  // Squares of costs overflowed, and the weights of the estimate were no numbers.
  CHECK(status_with(views, SectionId::view_camera, 16, 1e-12) == Status::corrupt_model);
  const AlignedBytes learned = seen_plates_model(2, 4);
  REQUIRE(status_of(learned.span()) == Status::ok);
  for (const float expected : {-1.0f, infinity, -infinity, std::nanf("")})
    CHECK(status_with(learned, SectionId::expected_residuals, 1, expected) == Status::corrupt_model);
  for (const SectionId spreads : {SectionId::pose_spreads, SectionId::pose_spreads_by_points}) {
    for (const double spread : {0.0, -1.0, double{infinity}, std::nan("")})
      CHECK(status_with(learned, spreads, 7, spread) == Status::corrupt_model);
    CHECK(status_with(learned, spreads, 1, 1e3) == Status::corrupt_model);  // a correlation above 1
  }
  CHECK(status_with(learned, SectionId::pose_numbers_by_points, 1, -1.0) == Status::corrupt_model);
  for (const std::size_t cost : {19u, 20u})
    CHECK(status_with(learned, SectionId::view_camera, cost, 1e11) == Status::corrupt_model);
  AlignedBytes blind = views;
  forge(blind.span(), SectionId::view_camera,
        [](auto&, std::span<std::byte> section) { std::ranges::fill(section, std::byte{0}); });
  CHECK(status_of(blind.span()) == Status::corrupt_model);
}

// Such models were opened; matching by fit, or forecasting, read images and shapes that did not exist.
TEST_CASE("views: a rig has all sections of its images and of the regression, or none") {
  const AlignedBytes learned = seen_plates_model(3, 3);
  for (const SectionId id : {SectionId::view_camera, SectionId::view_size, SectionId::view_depths,
                             SectionId::regression_numbers, SectionId::regression_basis, SectionId::regression_images,
                             SectionId::regression_weights, SectionId::regression_shapes}) {
    AlignedBytes lacking = learned;
    forge(lacking.span(), id, [](format::SectionEntry& entry, auto) { entry.part = 9; });  // of a rig without others
    CHECK(status_of(lacking.span()) == Status::corrupt_model);
  }
}

TEST_CASE("a regression whose numbers cannot be is refused") {
  const AlignedBytes model = seen_plates_model(3, 3);
  REQUIRE(status_of(model.span()) == Status::ok);
  for (const SectionId id : {SectionId::regression_basis, SectionId::regression_images, SectionId::regression_weights,
                             SectionId::regression_shapes})
    for (const float value : {infinity, std::nanf(""), 1e13f})
      CHECK(status_with(model, id, 3, value) == Status::corrupt_model);
  for (std::size_t word = 0; word < 5; ++word)
    for (const double value : {-1.0, std::nan(""), 1e300})
      CHECK(status_with(model, SectionId::regression_numbers, word, value) == Status::corrupt_model);
  for (const std::size_t positive : {0u, 1u})
    CHECK(status_with(model, SectionId::regression_numbers, positive, 0.0) == Status::corrupt_model);
  CHECK(status_with(model, SectionId::regression_numbers, 2, 1.5) == Status::corrupt_model);
  CHECK(status_with(model, SectionId::regression_numbers, 2, 0.0) == Status::ok);  // not used then
  for (std::size_t word = 0; word < 3; ++word)
    for (const double value : {-1.0, std::nan(""), 1e300})
      CHECK(status_with(model, SectionId::hidden_numbers, word, value) == Status::corrupt_model);
  CHECK(status_with(model, SectionId::hidden_numbers, 0, 0.0) == Status::corrupt_model);
  CHECK(status_with(model, SectionId::hidden_numbers, 1, 1.5) == Status::corrupt_model);
  for (std::size_t word = 0; word < all_prices.size(); ++word)
    for (const double value : {-1.0, 0.0, 1e-12, std::nan(""), 1e12})
      CHECK(status_with(model, SectionId::estimate_prices, word, value) == Status::corrupt_model);
  for (std::size_t word = 0; word < 2; ++word)
    for (const double value : {-1.0, std::nan(""), 1e300})
      CHECK(status_with(model, SectionId::spread_bounds, word, value) == Status::corrupt_model);
  CHECK(status_with(model, SectionId::spread_bounds, 0, 1.5) == Status::corrupt_model);
}

TEST_CASE("landmarks that are not finite are refused") {
  const AlignedBytes model = baked([](EnsembleDescription& description) { description.landmarks = true; });
  REQUIRE(status_of(model.span()) == Status::ok);
  for (const float value : {infinity, std::nanf(""), 1e13f})
    CHECK(status_with(model, SectionId::landmark_positions, 2, value) == Status::corrupt_model);
}

TEST_CASE("fields come back, exact or within what the model promises") {
  const SimulationMesh mesh = plate_mesh(small.shape);
  for (const bool is_compact : {false, true}) {
    const AlignedBytes bytes = is_compact
                                   ? baked([](EnsembleDescription& description) { description.compact_fields = true; })
                                   : baked([](EnsembleDescription&) {});
    const Model model = Model::view(bytes.span());
    REQUIRE(model.fields() == 1);
    REQUIRE(model.field_size(0) == mesh.elements.size());
    std::vector<float> read(mesh.elements.size());
    for (std::uint32_t run = 0; run < small.runs; ++run)
      for (std::uint32_t step = 0; step < small.steps; ++step) {
        const std::uint32_t sample = model.sample_index({run, step});
        const auto truth =
            bent_state(mesh, 0, final_angle(run) * step / (small.steps - 1), double{small.shape.length}).fields[0];
        model.read_field(0, sample, read);
        for (std::size_t e = 0; e < read.size(); ++e)
          CHECK(std::abs(read[e] - truth[e]) <= model.field(0).largest_error);
        CHECK(model.field_values(0, sample).size() == (is_compact ? 0 : read.size()));
      }
    CHECK((model.field(0).largest_error > 0) == is_compact);
    CHECK(status_with(bytes, SectionId::field_locations, 0, 1u) ==
          Status::corrupt_model);  // there are more nodes than elements
    CHECK(status_with(bytes, SectionId::field_locations, 0, 2u) == Status::corrupt_model);
  }
}

TEST_CASE("a model without parameters and fields has none") {
  const TemporaryFolder folder;
  Ensemble ensemble = bent_plates(small);
  ensemble.parameter_names.clear();
  for (EnsembleRun& run : ensemble.runs) run.parameters.clear();
  EnsembleDescription description = bent_plates_description();
  description.fields.clear();
  bake_model(ensemble, description, folder / "m.lbea");
  const AlignedBytes bytes(folder / "m.lbea");
  const Model model = Model::view(bytes.span());
  CHECK(model.parameters() == 0);
  CHECK(model.fields() == 0);
  CHECK(model.simulation_name(1) == "plate_1");
}

TEST_CASE("a section's values are of its own type, and an image in memory is aligned") {
  AlignedBytes bytes = baked([](EnsembleDescription&) {});
  const std::size_t size = bytes.span().size();
  std::vector<std::byte> memory(size + 128);
  void* aligned = memory.data();
  std::size_t room = memory.size();
  REQUIRE(std::align(64, size + 8, aligned, room) != nullptr);
  std::byte* const unaligned = static_cast<std::byte*>(aligned) + 8;
  std::memcpy(unaligned, bytes.span().data(), size);
  check_error(error_of([&] {
                static_cast<void>(Model::view({unaligned, size}));
              }),
              Status::bad_config, {"multiple of 64"});
  forge(bytes.span(), SectionId::node_positions, [](format::SectionEntry& entry, auto) {
    entry.element_type = static_cast<std::uint32_t>(format::ElementType::u32);
  });
  check_error(error_of([&] { static_cast<void>(Model::view(bytes.span())); }), Status::corrupt_model,
              {"unexpected element type"});
}
