#include "tests/support/synthetic_model.hpp"

#include <doctest/doctest.h>

using namespace lbea;
using namespace lbea::test;

TEST_CASE("a baked model opens and holds what went in") {
  for (const ReferenceMode mode : {ReferenceMode::impact, ReferenceMode::over_time}) {
    const AlignedBytes bytes = bent_plates_model(mode);
    const Model model = Model::view(bytes.span());
    CHECK(model.reference_mode() == mode);
    CHECK(model.samples() == 24);
    CHECK(model.references() == (mode == ReferenceMode::impact ? 1u : 6u));
    CHECK(model.nodes() == 200);
    CHECK(model.vertices() == 200);
  }
}
