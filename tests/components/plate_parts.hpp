// Components of the bending plates.
#pragma once

#include "tests/components/cut_run.hpp"
#include "tests/runtime/fit/seen_plates.hpp"

namespace lbea::test {

/// Bakes the plates between two planes across their length, in this order of runs.
inline void bake_part_of_plates(const std::filesystem::path& file, const Cut& cut, bool reversed = false) {
  bake::Ensemble ensemble = similar_plates(4, 6);
  for (bake::EnsembleRun& run : ensemble.runs)
    run.open = [open = run.open, cut] { return std::make_unique<CutRun>(open(), std::vector{cut}); };
  if (reversed) std::ranges::reverse(ensemble.runs);
  bake::EnsembleDescription description = bent_plates_description();
  description.fields.clear();
  bake::bake_model(ensemble, description, file, with_views());
}

/// The same as a model.
inline Model part_of_plates(const Cut& cut, bool reversed = false) {
  const TemporaryFolder folder;
  bake_part_of_plates(folder / "part.lbea", cut, reversed);
  return Model::open(folder / "part.lbea");
}

}  // namespace lbea::test
