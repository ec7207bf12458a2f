// Figures of docs/evaluation.md on runs with other meshes; no test.
//
//   mapping_figures resample RUN FOLDER       writes RUN on another triangulation of its surface, as d3plot
//   mapping_figures error REFERENCE RUN TRUE  maps RUN onto REFERENCE's mesh and compares it with TRUE, which has this
//                                             mesh, node by node; beside it the nearest node of the undeformed meshes
#include "adapters/simulation/open.hpp"
#include "precompute/mapping/mapped_run.hpp"
#include "tests/support/d3plot_writer.hpp"
#include "tests/support/resampled_run.hpp"

#include <cstdio>
#include <cstring>
#include <ctime>

namespace {
using namespace lbea;
using namespace lbea::bake;

void resample(const char* from, const char* to) {
  test::ResampledRun run(io::open_simulation(from));
  const SimulationMesh& mesh = run.mesh();
  test::D3plot database;
  const auto nodes_of = [](const std::vector<float>& positions) {
    std::vector<std::array<double, 3>> nodes;
    for (std::size_t i = 0; i < positions.size(); i += 3)
      nodes.push_back({double{positions[i]}, double{positions[i + 1]}, double{positions[i + 2]}});
    return nodes;
  };
  database.nodes = nodes_of(mesh.positions);
  database.shells = mesh.elements;
  database.shell_parts.assign(mesh.element_parts.begin(), mesh.element_parts.end());
  database.parts = *std::ranges::max_element(mesh.element_parts);
  for (std::uint32_t part = 1; part <= database.parts; ++part) database.part_ids.push_back(static_cast<int>(part));
  database.node_ids.assign(mesh.node_ids.begin(), mesh.node_ids.end());
  database.shell_ids.assign(mesh.element_ids.begin(), mesh.element_ids.end());
  SimulationState state;
  const auto strain = static_cast<std::size_t>(
      std::ranges::find(run.fields(), "plastic_strain", &SimulationField::name) - run.fields().begin());
  for (std::uint32_t i = 0; i < run.states(); ++i) {
    run.read(i, state);
    test::D3plotState& written = database.states.emplace_back();
    written.time = state.time_s;
    written.positions = nodes_of(state.positions);
    written.shells.resize(mesh.elements.size(), {std::vector<test::D3plotPoint>(1)});
    for (std::size_t e = 0; e < mesh.elements.size() && strain < state.fields.size(); ++e)
      written.shells[e].layers[0].plastic_strain = double{state.fields[strain][e]};
    written.shell_flags.assign(state.alive.begin(), state.alive.end());
  }
  std::filesystem::create_directories(to);
  test::write_d3plot(database, to);
}

struct NodeErrors {
  double mean = 0, largest = 0;
};

NodeErrors difference(const std::vector<float>& a, const std::vector<float>& b) {
  NodeErrors error;
  for (std::size_t i = 0; i < a.size(); i += 3) {
    const double d = std::hypot(double{a[i]} - double{b[i]}, double{a[i + 1]} - double{b[i + 1]},
                                double{a[i + 2]} - double{b[i + 2]});
    error.mean += d * 3 / static_cast<double>(a.size());
    error.largest = std::max(error.largest, d);
  }
  return error;
}

/// For every node of the reference mesh, the nearest of the run's; both undeformed.
std::vector<std::size_t> nearest_nodes(const std::vector<float>& reference, const std::vector<float>& run) {
  std::vector<std::size_t> nearest;
  for (std::size_t i = 0; i < reference.size(); i += 3) {
    double least = INFINITY;
    std::size_t best = 0;
    for (std::size_t j = 0; j < run.size(); j += 3) {
      double squared = 0;
      for (std::size_t axis = 0; axis < 3; ++axis)
        squared += std::pow(double{run[j + axis]} - double{reference[i + axis]}, 2);
      if (squared < least) least = squared, best = j;
    }
    nearest.push_back(best);
  }
  return nearest;
}

void print_error(const char* reference_name, const char* run_name, const char* true_name) {
  const auto reference = io::open_simulation(reference_name), run = io::open_simulation(run_name),
             truth = io::open_simulation(true_name);
  const std::clock_t begin = std::clock();
  const SurfaceMapping mapping = map_surface(reference->mesh(), run->mesh(), {}, "mm");
  const MappingReport& report = mapping.report;
  std::printf("%u of %u elements on %u, mean %.3f, largest %.3f at element %u, shift %.3f, %.0f ms of a processor\n",
              report.mapped_elements, report.elements, report.run_elements, report.mean, report.largest,
              report.worst_element, report.shift, 1e3 * static_cast<double>(std::clock() - begin) / CLOCKS_PER_SEC);
  if (report.mapped_elements != report.elements) return;
  const auto nearest = nearest_nodes(reference->mesh().positions, run->mesh().positions);
  SimulationState of_run, of_truth;
  std::vector<float> mapped;
  std::printf("state  mapped: mean  largest  nearest node: mean  largest [mm]\n");
  for (std::uint32_t state = 0; state < truth->states(); state += 5) {
    run->read(state, of_run);
    truth->read(state, of_truth);
    carry(mapping.nodes, of_run.positions, mapped);
    std::vector<float> copied;
    for (const std::size_t node : nearest)
      copied.insert(copied.end(), &of_run.positions[node], &of_run.positions[node] + 3);
    const NodeErrors ours = difference(mapped, of_truth.positions), theirs = difference(copied, of_truth.positions);
    std::printf("%5u %13.3f %8.3f %19.3f %8.3f\n", state, ours.mean, ours.largest, theirs.mean, theirs.largest);
  }
}
}  // namespace

int main(int count, char** arguments) {
  if (count == 4 && std::strcmp(arguments[1], "resample") == 0)
    resample(arguments[2], arguments[3]);
  else if (count == 5 && std::strcmp(arguments[1], "error") == 0)
    print_error(arguments[2], arguments[3], arguments[4]);
  else
    return 2;
}
