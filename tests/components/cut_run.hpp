// A component of a run: the elements between two planes.
#pragma once

#include "precompute/simulation.hpp"

#include <algorithm>
#include <memory>

namespace lbea::test {

/// The elements whose middle is in [least, most) along `axis` in the first state.
struct Cut {
  std::size_t axis = 0;
  float least = 0, most = 0;
};

class CutRun final : public bake::SimulationReader {
 public:
  /// The elements of all cuts.
  CutRun(std::unique_ptr<bake::SimulationReader> run, const std::vector<Cut>& cuts) : run_(std::move(run)) {
    const bake::SimulationMesh& whole = run_->mesh();
    std::vector<std::uint32_t> numbers(whole.nodes(), absent);
    for (std::uint32_t e = 0; e < whole.elements.size(); ++e)
      if (std::ranges::any_of(cuts, [&](const Cut& cut) { return is_inside(whole, whole.elements[e], cut); }))
        add(whole, e, numbers);
    for (const std::uint32_t node : nodes_) mesh_.node_ids.push_back(whole.node_ids[node]);
    keep_nodes(whole.positions, mesh_.positions);
    mesh_.has_solver_ids = whole.has_solver_ids;
  }
  [[nodiscard]] const bake::SimulationMesh& mesh() const noexcept override { return mesh_; }
  [[nodiscard]] const std::vector<bake::SimulationField>& fields() const noexcept override { return run_->fields(); }
  [[nodiscard]] std::uint32_t states() const noexcept override { return run_->states(); }
  [[nodiscard]] double time_s(std::uint32_t state) const override { return run_->time_s(state); }
  void read(std::uint32_t state, bake::SimulationState& into) override {
    run_->read(state, whole_);
    into.time_s = whole_.time_s;
    keep_nodes(whole_.positions, into.positions);
    into.alive.clear();
    for (const std::uint32_t e : elements_) into.alive.push_back(whole_.alive[e]);
    into.fields.assign(whole_.fields.size(), {});
    for (std::size_t f = 0; f < whole_.fields.size(); ++f)
      for (const std::uint32_t e : elements_) into.fields[f].push_back(whole_.fields[f][e]);
  }
  [[nodiscard]] std::vector<std::filesystem::path> files() const override { return run_->files(); }

 private:
  static constexpr std::uint32_t absent = std::numeric_limits<std::uint32_t>::max();
  static bool is_inside(const bake::SimulationMesh& whole, const bake::Quad& element, const Cut& cut) {
    float middle = 0;
    for (const std::uint32_t node : element) middle += whole.positions[3 * node + cut.axis] / 4;
    return middle >= cut.least && middle < cut.most;
  }
  void add(const bake::SimulationMesh& whole, std::uint32_t e, std::vector<std::uint32_t>& numbers) {
    elements_.push_back(e);
    mesh_.element_ids.push_back(whole.element_ids[e]);
    mesh_.element_parts.push_back(whole.element_parts[e]);
    bake::Quad element = whole.elements[e];
    for (std::uint32_t& node : element) {
      if (numbers[node] == absent) {
        numbers[node] = static_cast<std::uint32_t>(nodes_.size());
        nodes_.push_back(node);
      }
      node = numbers[node];
    }
    mesh_.elements.push_back(element);
  }
  void keep_nodes(const std::vector<float>& from, std::vector<float>& into) const {
    into.clear();
    for (const std::uint32_t node : nodes_) into.insert(into.end(), &from[3 * node], &from[3 * node] + 3);
  }

  std::unique_ptr<bake::SimulationReader> run_;
  std::vector<std::uint32_t> elements_, nodes_;  // of the whole run
  bake::SimulationMesh mesh_;
  bake::SimulationState whole_;
};

}  // namespace lbea::test
