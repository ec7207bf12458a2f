// The runs of an ensemble, ready to be opened as often as needed and from any thread.
#pragma once

#include "precompute/simulation.hpp"

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <vector>

namespace lbea::bake {

struct InputFile {
  std::string name;  // without folder
  std::uint64_t size = 0;
  std::uint64_t hash = 0;  // XXH3-64
};

struct EnsembleRun {
  std::string name;
  std::vector<double> parameters;  // in the order of Ensemble::parameter_names; NaN: not given
  std::function<std::unique_ptr<SimulationReader>()> open;
  std::string source = {};            // what another process opens it by, a path for instance; empty: only this one can
  std::vector<InputFile> files = {};  // what it consists of, when that is known: not hashed again then
  std::size_t rounded_elements = 0;   // over which its fields have been rounded to 16 bits already; 0: they have not
};

struct Ensemble {
  std::vector<EnsembleRun> runs;
  std::vector<std::string> parameter_names;
  std::size_t reference_run = 0;  // index into runs
};

}  // namespace lbea::bake
