// Components of the bending plates.
#pragma once

#include "tests/components/cut_run.hpp"
#include "tests/runtime/seen_plates.hpp"

namespace lbea::test {

/// The plates between two planes across their length, in this order of runs.
inline Model part_of_plates(const Cut& cut, bool reversed = false) {
  const TemporaryFolder folder;
  bake::Ensemble ensemble = similar_plates(4, 6);
  for (bake::EnsembleRun& run : ensemble.runs)
    run.open = [open = run.open, cut] { return std::make_unique<CutRun>(open(), std::vector{cut}); };
  if (reversed) std::ranges::reverse(ensemble.runs);
  bake::EnsembleDescription description = bent_plates_description();
  description.fields.clear();
  bake::bake_model(ensemble, description, folder / "part.lbea", with_views());
  return Model::open(folder / "part.lbea");
}

}  // namespace lbea::test
