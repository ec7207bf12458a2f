// The rail ensemble against an independent implementation's numbers.
#include "adapters/ensemble/ensemble_toml.hpp"
#include "adapters/simulation/open.hpp"
#include "precompute/bake.hpp"
#include "runtime/src/model/model_view.hpp"
#include "tests/support/test_data.hpp"

#include <doctest/doctest.h>
#include <nlohmann/json.hpp>

#include <cmath>
#include <fstream>

using namespace lbea;
using namespace lbea::bake;
using namespace lbea::io;
using namespace lbea::test;

namespace {

nlohmann::json expected() {
  return nlohmann::json::parse(std::ifstream(reference_data() / "rail" / "reference" / "expected.json"));
}

Ensemble rail(const nlohmann::json& names) {
  Ensemble ensemble;
  for (const std::string name : names) {
    const auto path = reference_data() / "rail" / "runs" / name;
    ensemble.runs.push_back({name, {}, [path] { return open_simulation(path); }});
  }
  return ensemble;
}

}  // namespace

TEST_CASE("the rail's basis and S_proj agree with an independent implementation") {
  const nlohmann::json reference = expected();
  EnsembleDescription description;
  description.region.node_ids = read_node_ids(reference_data() / "rail" / "reference" / "nodes.txt");
  const TemporaryFolder folder;
  const BakeSummary summary = bake_model(rail(reference["simulations"]), description, folder / "rail.lbea");
  const Model model = Model::open(folder / "rail.lbea");
  CHECK(model.vertices() == reference["n"].get<std::uint32_t>());
  CHECK(model.samples() == reference["s"].get<std::uint32_t>());
  CHECK(model.nodes() == 2436);
  CHECK(summary.basis_residual < 1e-12);

  const auto eigenvalues = reference["eigenvalues"].get<std::vector<double>>();
  REQUIRE(model.modes() == eigenvalues.size());
  CHECK(std::abs(model.eigenvalues(0)[0]) < 1e-9 * eigenvalues[1]);
  for (std::size_t j = 1; j < eigenvalues.size(); ++j)
    CHECK(model.eigenvalues(0)[j] == doctest::Approx(eigenvalues[j]).epsilon(1e-9));

  const ReferenceView& view = model.view().references[0];
  const std::size_t n = model.vertices(), p = model.modes(), stride = format::padded(n), plane = format::padded(p);
  for (std::size_t i = 0; i < p; ++i)  // psi' M psi = I
    for (std::size_t j = 0; j <= i; ++j) {
      double product = 0;
      for (std::size_t v = 0; v < n; ++v)
        product += static_cast<double>(view.projection[i * stride + v]) *
                   static_cast<double>(view.projection[j * stride + v]) / view.mass[v];
      REQUIRE(product == doctest::Approx(i == j).epsilon(1e-6).scale(1));
    }
  for (std::uint32_t s = 0; s < model.samples(); s += 37)  // the nearest of all nodes, and alpha = Psi' M f
    for (std::size_t axis = 0; axis < 3; ++axis)
      for (std::size_t mode = 0; mode < p; mode += 11) {
        double alpha = 0, magnitude = 0;
        for (std::size_t v = 0; v < n; ++v) {
          const float x = model.node_positions(s)[3 * std::size_t{view.correspondence[s * n + v]} + axis];
          const double term = static_cast<double>(view.projection[mode * stride + v]) * static_cast<double>(x);
          alpha += term;
          magnitude += std::abs(term);
        }
        REQUIRE(std::abs(static_cast<double>(view.coefficients[(3 * s + axis) * plane + mode]) - alpha) <
                2.4e-7 * magnitude);
      }
}

TEST_CASE("the rail's correspondences are the nearest of all nodes, by brute force") {
  const nlohmann::json reference = expected();
  EnsembleDescription description;
  description.region.node_ids = read_node_ids(reference_data() / "rail" / "reference" / "nodes.txt");
  description.steps.list = {0, 15, 30};
  description.modes = 20;
  const TemporaryFolder folder;
  Ensemble ensemble = rail(reference["simulations"]);
  ensemble.runs.resize(3);
  bake_model(ensemble, description, folder / "rail.lbea");
  const Model model = Model::open(folder / "rail.lbea");
  const ReferenceView& view = model.view().references[0];
  for (std::uint32_t s = 0; s < model.samples(); ++s) {
    const auto nodes = model.node_positions(s);
    for (std::size_t v = 0; v < model.vertices(); ++v) {
      const auto distance = [&](std::size_t node) {
        const auto& at = view.tree.vertices[v];
        return std::hypot(static_cast<double>(nodes[3 * node]) - static_cast<double>(at[0]),
                          static_cast<double>(nodes[3 * node + 1]) - static_cast<double>(at[1]),
                          static_cast<double>(nodes[3 * node + 2]) - static_cast<double>(at[2]));
      };
      double least = INFINITY;
      for (std::size_t node = 0; node < model.nodes(); ++node) least = std::min(least, distance(node));
      REQUIRE(distance(view.correspondence[s * model.vertices() + v]) <= least + 1e-4);  // single precision at 400 mm
    }
  }
}
