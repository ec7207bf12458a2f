// A run on another triangulation of its surface: the middles of its edges are the nodes. Every element becomes the one
// between the middles of its edges; in each corner, the middles around an inner node form another element. Nodes at
// borders, between parts and where not four elements meet remain, with a triangle per corner.
#pragma once

#include "precompute/simulation.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <memory>
#include <optional>
#include <utility>

namespace lbea::test {

using namespace lbea::bake;

class ResampledRun : public SimulationReader {
 public:
  explicit ResampledRun(std::unique_ptr<SimulationReader> run) : run_(std::move(run)) {
    const SimulationMesh& old = run_->mesh();
    corners_.resize(old.nodes());
    for (std::uint32_t e = 0; e < old.elements.size(); ++e) add_middle_element(e);
    for (std::uint32_t node = 0; node < old.nodes(); ++node)
      if (!add_around(node)) add_corners(node);
    for (std::uint32_t i = 0; i < ends_.size(); ++i) mesh_.node_ids.push_back(700'001 + i);
    for (std::uint32_t e = 0; e < mesh_.elements.size(); ++e) mesh_.element_ids.push_back(800'001 + e);
    mesh_.positions = at_nodes(old.positions);
  }

  const SimulationMesh& mesh() const noexcept override { return mesh_; }
  const std::vector<SimulationField>& fields() const noexcept override { return run_->fields(); }
  std::uint32_t states() const noexcept override { return run_->states(); }
  double time_s(std::uint32_t state) const override { return run_->time_s(state); }
  std::vector<std::filesystem::path> files() const override { return {}; }
  void read(std::uint32_t state, SimulationState& into) override {
    SimulationState old;
    run_->read(state, old);
    into = {old.time_s, at_nodes(old.positions), {}, std::vector<std::vector<float>>(old.fields.size())};
    for (const auto& sources : sources_) {
      into.alive.push_back(std::ranges::all_of(sources, [&](std::uint32_t e) { return old.alive[e] != 0; }) ? 1 : 0);
      for (std::size_t field = 0; field < old.fields.size(); ++field) {
        float sum = 0;
        for (const std::uint32_t e : sources) sum += old.fields[field][e];
        into.fields[field].push_back(sum / static_cast<float>(sources.size()));
      }
    }
  }

 private:
  using Ends = std::pair<std::uint32_t, std::uint32_t>;  // of an edge of the old mesh; equal: a node of it
  struct Corner {
    std::uint32_t element, before, after;  // the new nodes on the edges that meet there
  };

  std::uint32_t node_at(std::uint32_t a, std::uint32_t b) {
    const Ends ends = std::minmax(a, b);
    const auto [found, is_new] = numbers_.emplace(ends, static_cast<std::uint32_t>(ends_.size()));
    if (is_new) ends_.push_back(ends);
    return found->second;
  }
  void add(const Quad& element, std::vector<std::uint32_t> sources) {
    mesh_.elements.push_back(element);
    mesh_.element_parts.push_back(run_->mesh().element_parts[sources.front()]);
    sources_.push_back(std::move(sources));
  }
  void add_middle_element(std::uint32_t e) {
    const Quad& q = run_->mesh().elements[e];
    const std::size_t sides = q[2] == q[3] ? 3 : 4;
    Quad middles{};
    for (std::size_t i = 0; i < sides; ++i) middles[i] = node_at(q[i], q[(i + 1) % sides]);
    if (sides == 3) middles[3] = middles[2];
    for (std::size_t i = 0; i < sides; ++i) corners_[q[i]].push_back({e, middles[(i + sides - 1) % sides], middles[i]});
    add(middles, {e});
  }
  /// Four corners of one part whose edges form a ring.
  bool add_around(std::uint32_t node) {
    const auto& corners = corners_[node];
    const auto& parts = run_->mesh().element_parts;
    if (corners.size() != 4) return false;
    Quad ring{};
    std::vector<std::uint32_t> sources;
    std::uint32_t next = corners[0].before;
    for (std::uint32_t& place : ring) {
      const auto corner = std::ranges::find_if(corners, [&](const Corner& c) {
        return (c.before == next || c.after == next) && std::ranges::find(sources, c.element) == sources.end();
      });
      if (corner == corners.end() || parts[corner->element] != parts[corners[0].element]) return false;
      place = next;
      next = corner->before == next ? corner->after : corner->before;
      sources.push_back(corner->element);
    }
    if (next != ring[0]) return false;
    if (bulge(node, ring[1], ring[3]) < bulge(node, ring[0], ring[2]))
      std::rotate(ring.begin(), ring.begin() + 1, ring.end());
    add(ring, sources);
    return true;
  }
  void add_corners(std::uint32_t node) {
    for (const Corner& corner : corners_[node]) {
      const std::uint32_t middle = node_at(node, node);
      add({middle, corner.after, corner.before, corner.before}, {corner.element});
    }
  }
  /// Distance of the old node from the middle between two new ones: quads are split along the ridge they lie on.
  [[nodiscard]] double bulge(std::uint32_t node, std::uint32_t a, std::uint32_t b) const {
    double squared = 0;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const auto old = [&](std::uint32_t i) { return double{run_->mesh().positions[3 * std::size_t{i} + axis]}; };
      const auto middle = [&](std::uint32_t i) { return (old(ends_[i].first) + old(ends_[i].second)) / 2; };
      squared += std::pow((middle(a) + middle(b)) / 2 - old(node), 2);
    }
    return squared;
  }
  [[nodiscard]] std::vector<float> at_nodes(const std::vector<float>& old) const {
    std::vector<float> positions;
    for (const auto& [a, b] : ends_)
      for (std::size_t axis = 0; axis < 3; ++axis)
        positions.push_back(0.5f * (old[3 * std::size_t{a} + axis] + old[3 * std::size_t{b} + axis]));
    return positions;
  }

  std::unique_ptr<SimulationReader> run_;
  SimulationMesh mesh_;
  std::map<Ends, std::uint32_t> numbers_;
  std::vector<Ends> ends_;                           // per new node
  std::vector<std::vector<Corner>> corners_;         // per old node
  std::vector<std::vector<std::uint32_t>> sources_;  // per new element
};

}  // namespace lbea::test
