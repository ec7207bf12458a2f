// One run as d3plot and as the solver's converter writes it in VTK: the same mesh, states and, baked, the same S_proj.
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>

#include "adapters/simulation/open.hpp"
#include "precompute/bake.hpp"
#include "runtime/src/model/model_view.hpp"
#include "tests/support/refusals.hpp"
#include "tests/support/test_data.hpp"

using namespace lbea;
using namespace lbea::bake;
using namespace lbea::io;

namespace {

constexpr double ms = 1e-3;

std::filesystem::path run(const char* name) { return test::reference_data() / "vtk" / name; }

/// The text has six significant digits.
bool agrees(float a, float b) { return std::abs(a - b) <= 5.1e-6f * std::abs(a) + 1e-30f; }

std::size_t differing(const std::vector<float>& a, const std::vector<float>& b) {
  REQUIRE(a.size() == b.size());
  std::size_t count = 0;
  for (std::size_t i = 0; i < a.size(); ++i) count += agrees(a[i], b[i]) ? 0u : 1u;
  return count;
}

Model baked(const char* name, double time_factor, const test::TemporaryFolder& folder) {
  EnsembleDescription description;
  description.time_factor = time_factor;
  Ensemble ensemble;
  ensemble.runs.push_back({name, {}, [name] { return open_simulation(run(name)); }});
  const auto file = folder / (std::string(name) + ".lbea");
  bake_model(ensemble, description, file);
  return Model::open(file);
}

}  // namespace

TEST_CASE("a VTK series is the run that d3plot holds") {
  const auto d3plot = open_simulation(run("run_004_d3plot")), vtk = open_simulation(run("run_004"));
  CHECK(vtk->mesh().node_ids == d3plot->mesh().node_ids);
  CHECK(vtk->mesh().elements == d3plot->mesh().elements);
  CHECK(vtk->mesh().element_ids == d3plot->mesh().element_ids);
  CHECK(vtk->mesh().element_parts == d3plot->mesh().element_parts);
  CHECK(differing(d3plot->mesh().positions, vtk->mesh().positions) == 0);
  REQUIRE(vtk->states() == d3plot->states());
  CHECK(vtk->files().size() == vtk->states());
  const auto& fields = vtk->fields();
  const auto strain =
      std::find_if(fields.begin(), fields.end(), [](const auto& f) { return f.name == "plastic_strain"; });
  REQUIRE(strain != fields.end());
  SimulationState a, b;
  for (std::uint32_t s = 0; s < vtk->states(); ++s) {
    CAPTURE(s);
    d3plot->read(s, a);
    vtk->read(s, b);
    CHECK(b.time_s * ms == doctest::Approx(a.time_s).epsilon(1e-5));
    CHECK(vtk->time_s(s) == b.time_s);
    CHECK(differing(a.positions, b.positions) == 0);
    CHECK(b.alive == a.alive);
    CHECK(differing(a.fields[0], b.fields[static_cast<std::size_t>(strain - fields.begin())]) == 0);
  }
}

TEST_CASE("any file of the series stands for the run") {
  CHECK(open_simulation(run("run_004") / "R004A031.vtk")->states() == 11);
}

TEST_CASE("both bake to the same S_proj") {
  const test::TemporaryFolder folder;
  const Model a = baked("run_004_d3plot", 1, folder), b = baked("run_004", ms, folder);
  REQUIRE(a.samples() == b.samples());
  REQUIRE(a.modes() == b.modes());
  const auto alpha = a.view().references[0].coefficients, beta = b.view().references[0].coefficients;
  REQUIRE(alpha.size() == beta.size());
  double difference = 0, magnitude = 0;
  for (std::size_t i = 0; i < alpha.size(); ++i) {
    difference = std::max(difference, std::abs(static_cast<double>(alpha[i]) - static_cast<double>(beta[i])));
    magnitude = std::max(magnitude, std::abs(static_cast<double>(alpha[i])));
  }
  MESSAGE("largest difference of a coefficient, relative to the largest coefficient: " << difference / magnitude);
  CHECK(difference < 1e-5 * magnitude);
  for (std::uint32_t s = 0; s < a.samples(); ++s) {
    CAPTURE(s);
    const std::size_t per_sample = alpha.size() / a.samples();
    double distance = 0, norm = 0;
    for (std::size_t i = s * per_sample; i < (s + 1) * per_sample; ++i) {
      distance += std::pow(static_cast<double>(alpha[i]) - static_cast<double>(beta[i]), 2);
      norm += std::pow(static_cast<double>(alpha[i]), 2);
    }
    CHECK(std::sqrt(distance) < 1e-5 * std::sqrt(norm));
  }
}
