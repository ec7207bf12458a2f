#include "precompute/survey/envelope.hpp"
#include "tests/precompute/baked.hpp"

#include <doctest/doctest.h>

#include <cmath>

using namespace lbea;
using namespace lbea::bake;
using namespace lbea::test;

TEST_CASE("the model holds the ensemble") {
  for (const ReferenceMode mode : {ReferenceMode::impact, ReferenceMode::over_time}) {
    const Baked baked(bent_plates(), bent_plates_description(mode));
    const Model& model = baked.model;
    CHECK(model.reference_mode() == mode);
    CHECK(model.references() == (mode == ReferenceMode::impact ? 1u : 6u));
    CHECK(model.samples() == 24);
    CHECK(model.simulations() == 4);
    CHECK(model.vertices() == 200);
    CHECK(model.simulation_name(2) == "plate_2");
    CHECK(model.parameter_name(0) == "final_angle [rad]");
    CHECK(model.parameter(3, 0) == final_angle(3));
    CHECK(model.field(0).name == "plastic_strain");
    CHECK(model.length_unit() == "mm");
    for (std::uint32_t s = 0; s < 24; ++s) {
      CHECK(model.sample(s) == Sample{s / 6, s % 6});
      CHECK(model.sample_time_s(s) == 0.0005 * (s % 6));
      SimulationState state;
      bending_plate(final_angle(s / 6), 6).read(s % 6, state);
      CHECK(std::ranges::equal(model.node_positions(s), state.positions));
      CHECK(std::ranges::equal(model.field_values(0, s), state.fields[0]));
    }
    for (std::uint32_t r = 0; r < model.references(); ++r)
      CHECK(model.reference_time_s(r) == doctest::Approx(0.0005 * r));
  }
}

TEST_CASE("correspondences are the nearest nodes, coefficients are Psi' M f") {
  for (const ReferenceMode mode : {ReferenceMode::impact, ReferenceMode::over_time}) {
    const Baked baked(bent_plates(), bent_plates_description(mode));
    for (std::uint32_t r = 0; r < baked.model.references(); ++r) {
      const Eigen::MatrixXd psi_m = projection(baked, r);
      for (std::uint32_t s = 0; s < baked.model.samples(); ++s) {
        const auto nodes = baked.model.node_positions(s);
        for (std::size_t v = 0; v < baked.model.vertices(); ++v) {
          const std::uint32_t found = baked.reference(r).correspondence[s * baked.model.vertices() + v];
          const auto& vertex = baked.reference(r).tree.vertices[v];
          const std::uint32_t best = nearest_node(nodes, vertex);
          const auto distance = [&](std::uint32_t node) {
            return std::hypot(static_cast<double>(nodes[3 * node] - vertex[0]),
                              static_cast<double>(nodes[3 * node + 1] - vertex[1]),
                              static_cast<double>(nodes[3 * node + 2] - vertex[2]));
          };
          const bool as_near =
              found == best || std::abs(distance(found) - distance(best)) < 1e-5;  // single precision, 200 mm
          REQUIRE(as_near);
        }
        // psi_m is rounded to single precision: |error| <= 2^-24 sum |psi_m| |f|.
        const Eigen::MatrixXd f = corresponding(baked, r, s);
        const double rounding = 2 * 6e-8 * (psi_m.cwiseAbs() * f.cwiseAbs()).maxCoeff();
        CHECK((coefficients(baked, r, s) - psi_m * f).cwiseAbs().maxCoeff() < rounding);
      }
    }
  }
}

TEST_CASE("the reference run's own samples over time correspond to themselves") {
  const Baked baked(bent_plates(), bent_plates_description(ReferenceMode::over_time));
  for (std::uint32_t r = 0; r < 6; ++r)
    for (std::size_t v = 0; v < 200; ++v)
      CHECK(baked.reference(r).correspondence[r * 200 + v] == baked.model.vertex_nodes(r)[v]);
}

TEST_CASE("a field in the span of the basis comes back as its coefficients") {
  // Waves in z of less than half a cell: every vertex stays nearest to its own node.
  const SimulationMesh mesh = plate_mesh();
  const Baked flat(bent_plates({1, 1, {}}), bent_plates_description());
  const Eigen::MatrixXd psi_m = projection(flat, 0);
  std::vector<SimulationState> states;
  constexpr std::array<std::uint32_t, 4> modes{1, 2, 7, 19};
  for (const std::uint32_t mode : modes) {
    SimulationState state = bent_state(mesh, 0.001 * mode, 0, 190);
    for (std::uint32_t v = 0; v < 200; ++v) {
      const double psi = psi_m(mode, v) / flat.reference().mass[v];
      state.positions[3 * flat.model.vertex_nodes(0)[v] + 2] = static_cast<float>(100 * psi);
    }
    states.push_back(std::move(state));
  }
  Ensemble ensemble = bent_plates({2, 6, {}});
  ensemble.runs[1].open = [&] {
    return std::make_unique<SyntheticSimulation>(mesh, states, std::vector<SimulationField>{{"plastic_strain", "1"}});
  };
  const Baked baked(ensemble, bent_plates_description());
  for (std::uint32_t k = 0; k < modes.size(); ++k) {
    const Eigen::VectorXd z = coefficients(baked, 0, 6 + k).col(2);
    const Eigen::VectorXd expected = 100 * Eigen::VectorXd::Unit(20, modes[k]);
    CHECK((z - expected).cwiseAbs().maxCoeff() < 100 * 1e-6);  // positions are rounded to single precision
  }
}

TEST_CASE("the same input bakes to the same bytes, with any number of threads") {
  for (const ReferenceMode mode : {ReferenceMode::impact, ReferenceMode::over_time}) {
    const auto bytes = [&](unsigned threads) {
      BakeOptions options;
      options.threads = threads;
      return Baked(bent_plates(), bent_plates_description(mode), options).bytes();
    };
    const auto first = bytes(1);
    CHECK(bytes(1) == first);
    CHECK(bytes(2) == first);
    CHECK(bytes(4) == first);
  }
}

TEST_CASE("kept variance follows its definition") {
  EnsembleDescription description = bent_plates_description();
  double before = 0;
  for (const std::uint32_t p : {1u, 5u, 20u, 200u}) {
    description.modes = p;
    const Baked baked(bent_plates(), description);
    const Eigen::Map<const Eigen::VectorXd> mass(baked.reference().mass.data(), 200);
    Eigen::MatrixXd mean = Eigen::MatrixXd::Zero(200, 3);
    for (std::uint32_t s = 0; s < 24; ++s) mean += corresponding(baked, 0, s) / 24;
    const Eigen::MatrixXd psi_m = projection(baked, 0);
    double kept = 0, total = 0;
    for (std::uint32_t s = 0; s < 24; ++s) {
      const Eigen::MatrixXd f = corresponding(baked, 0, s) - mean;
      kept += (psi_m * f).squaredNorm();
      total += mass.dot(f.rowwise().squaredNorm());
    }
    CHECK(baked.summary.kept_variance == doctest::Approx(kept / total).epsilon(1e-6));
    CHECK(baked.summary.kept_variance > before);
    before = baked.summary.kept_variance;
  }
  CHECK(before == doctest::Approx(1).epsilon(1e-9));  // p = n: a complete basis
}

TEST_CASE("one sample does not vary") {
  const Baked baked(bent_plates({1, 1, {}}), bent_plates_description());
  CHECK(std::isnan(baked.summary.kept_variance));
  CHECK(baked.model.provenance().find("\"kept_variance\":null") != std::string_view::npos);
}

TEST_CASE("every sample's surface lies inside the envelope, with the margin") {
  const Baked baked(bent_plates(), bent_plates_description());
  const EnvelopeView& view = baked.model.view().envelope;
  const EnvelopeGrid grid{view.corner, view.cell, view.cells, {view.bits.begin(), view.bits.end()}};
  for (std::uint32_t s = 0; s < 24; ++s) {
    const auto nodes = baked.model.node_positions(s);
    for (std::size_t i = 0; i < 200; ++i)
      for (const float offset : {-24.9f, 0.f, 24.9f})
        CHECK(grid.contains({nodes[3 * i], nodes[3 * i + 1], nodes[3 * i + 2] + offset}));
  }
}

TEST_CASE("the smallest model: one run, one state, one triangle, as many modes as vertices") {
  SimulationMesh mesh;
  mesh.positions = {0, 0, 0, 10, 0, 0, 0, 10, 0};
  mesh.node_ids = {1, 2, 3};
  mesh.elements = {{0, 1, 2, 2}};
  mesh.element_ids = {1};
  mesh.element_parts = {1};
  Ensemble ensemble;
  ensemble.runs.push_back(
      {"only", {}, [mesh] {
         return std::make_unique<SyntheticSimulation>(mesh, std::vector{SimulationState{0, mesh.positions, {1}, {}}});
       }});
  EnsembleDescription description;
  description.modes = 3;
  description.fields.clear();
  const Baked baked(ensemble, description);
  CHECK(baked.model.vertices() == 3);
  CHECK(baked.model.parameters() == 0);
  CHECK(baked.model.fields() == 0);
  const Eigen::MatrixXd f = corresponding(baked, 0, 0);
  CHECK((coefficients(baked, 0, 0) - projection(baked, 0) * f).cwiseAbs().maxCoeff() < 1e-4);
}

TEST_CASE("a matcher finds each sample by its own nodes") {
  const Baked baked(bent_plates(), bent_plates_description());
  Matcher matcher(baked.model);
  for (std::uint32_t s = 0; s < 24; ++s) {
    std::vector<Point> points;
    const auto nodes = baked.model.node_positions(s);
    for (std::size_t i = 0; i < 200; ++i) points.push_back({nodes[3 * i], nodes[3 * i + 1], nodes[3 * i + 2]});
    const MatchResult result = matcher.match({s, 0, points});
    REQUIRE_FALSE(result.matches.empty());
    const std::uint32_t flat = s % 6 == 0 ? 0 : s;  // all runs begin flat: the first one stands for them
    CHECK(baked.model.sample_index(result.matches[0].sample) == flat);
  }
}
