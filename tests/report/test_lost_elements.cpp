// The sentence on elements that the best sample's simulation has lost.
#include "tests/support/eroding_plates.hpp"
#include "tools/report/content/comparison/lost_elements.hpp"

#include <doctest/doctest.h>

using namespace lbea;
using namespace lbea::test;
using namespace lbea::tool;

TEST_CASE("a simulation that erodes has lost its patch at its end; its twin, and plates that do not erode, nothing") {
  const TemporaryFolder folder;
  bake_model(eroding_plates(1, 6, 4), bent_plates_description(), folder / "m.lbea");
  const Model model = Model::open(folder / "m.lbea");
  CHECK(lost_elements_sentence(model, 0).empty());
  CHECK(lost_elements_sentence(model, 1) ==
        "At its end, simulation eroding_0 of the best sample has lost 16 of 171 elements.");
  CHECK(lost_elements_sentence(model, 2).empty());  // there is none
  bake_bent_plates(folder / "bent.lbea");
  CHECK(lost_elements_sentence(Model::open(folder / "bent.lbea"), 0).empty());
}
