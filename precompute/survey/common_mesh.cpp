#include "precompute/survey/common_mesh.hpp"

#include <lbea/lbea.hpp>

#include <algorithm>
#include <cmath>
#include <map>
#include <unordered_map>

namespace lbea::bake {
namespace {
constexpr std::uint32_t nowhere = std::numeric_limits<std::uint32_t>::max();

using NodeIndex = std::unordered_map<std::uint32_t, std::uint32_t>;  // id -> index

// Sorted: the faces of one solid share its id and differ in their nodes.
using ElementKey = std::array<std::uint32_t, 5>;
using ElementIndex = std::map<ElementKey, std::uint32_t>;

NodeIndex index_nodes(const std::vector<std::uint32_t>& ids, const std::string& run) {
  NodeIndex index;
  index.reserve(ids.size());
  for (std::uint32_t i = 0; i < ids.size(); ++i)
    if (!index.emplace(ids[i], i).second)
      throw Error(Status::bad_input, "run " + run + ": node id " + std::to_string(ids[i]) + " is given twice");
  return index;
}

ElementKey key_of(const std::vector<std::uint32_t>& node_ids, const Quad& element, std::uint32_t id) {
  return {id, node_ids[element[0]], node_ids[element[1]], node_ids[element[2]], node_ids[element[3]]};
}

ElementIndex index_elements(const SimulationMesh& mesh) {
  ElementIndex index;
  for (std::uint32_t e = 0; e < mesh.elements.size(); ++e)
    index.emplace(key_of(mesh.node_ids, mesh.elements[e], mesh.element_ids[e]), e);
  return index;
}

bool same_numbering(const SimulationMesh& a, const SimulationMesh& b) {
  return a.node_ids == b.node_ids && a.element_ids == b.element_ids && a.elements == b.elements;
}

/// In the samples of both.
Presence in_both(Presence a, Presence b) {
  if (a == Presence::missing || b == Presence::missing) return Presence::missing;
  return a == b ? a : Presence::sometimes;
}

double edge_length(const SimulationMesh& mesh, std::uint32_t element) {
  const float* a = &mesh.positions[3 * std::size_t{mesh.elements[element][0]}];
  const float* b = &mesh.positions[3 * std::size_t{mesh.elements[element][1]}];
  return std::hypot(double{a[0]} - double{b[0]}, double{a[1]} - double{b[1]}, double{a[2]} - double{b[2]});
}
}  // namespace

void check_mesh(const SimulationMesh& mesh, const std::string& run) {
  const bool consistent = mesh.element_ids.size() == mesh.elements.size() &&
                          mesh.element_parts.size() == mesh.elements.size() &&
                          mesh.positions.size() == 3 * mesh.nodes() && mesh.touching <= mesh.elements.size() &&
                          mesh.node_ids.size() < nowhere && mesh.elements.size() < nowhere;
  if (!consistent) throw Error(Status::bad_input, "run " + run + ": its mesh is not complete or too large");
  for (const Quad& element : mesh.elements)
    for (const std::uint32_t node : element)
      if (node >= mesh.node_ids.size())
        throw Error(Status::bad_input, "run " + run + ": an element names node index " + std::to_string(node) +
                                           ", but there are " + std::to_string(mesh.node_ids.size()) + " nodes");
}

bool has_numbers_of(const SimulationMesh& reference, const SimulationMesh& mesh) {
  if (same_numbering(mesh, reference)) return true;
  constexpr double least_share = 0.9, most_change = 0.1;
  const ElementIndex index = index_elements(mesh);
  std::size_t shared = 0;
  double length = 0, change = 0;
  for (std::uint32_t e = 0; e < reference.elements.size(); ++e) {
    const auto found = index.find(key_of(reference.node_ids, reference.elements[e], reference.element_ids[e]));
    if (found == index.end()) continue;
    ++shared;
    length += edge_length(reference, e);
    change += std::abs(edge_length(mesh, found->second) - edge_length(reference, e));
  }
  const auto smaller = static_cast<double>(std::min(reference.elements.size(), mesh.elements.size()));
  return static_cast<double>(shared) >= least_share * smaller && change <= most_change * length;
}

void PresenceInStates::add(std::span<const std::uint8_t> surface) {
  for (std::size_t e = 0; e < surface.size(); ++e) (surface[e] != 0 ? seen_ : lacked_)[e] = 1;
}

std::vector<Presence> PresenceInStates::presence() const {
  std::vector<Presence> presence(seen_.size());
  std::ranges::transform(seen_, lacked_, presence.begin(), [](std::uint8_t seen, std::uint8_t lacked) {
    if (seen == 0) return Presence::never;
    return lacked == 0 ? Presence::always : Presence::sometimes;
  });
  return presence;
}

std::vector<Presence> common_elements(const SimulationMesh& reference, const SimulationMesh& mesh,
                                      std::span<const Presence> present, const std::string& run) {
  check_mesh(mesh, run);
  if (present.size() != mesh.elements.size())
    throw Error(Status::bad_input, "run " + run + ": deletion flags for " + std::to_string(present.size()) +
                                       " elements, but there are " + std::to_string(mesh.elements.size()));
  if (same_numbering(mesh, reference)) return {present.begin(), present.end()};
  std::vector<Presence> common(reference.elements.size());
  (void)index_nodes(mesh.node_ids, run);
  const ElementIndex index = index_elements(mesh);
  for (std::size_t e = 0; e < common.size(); ++e) {
    const auto found = index.find(key_of(reference.node_ids, reference.elements[e], reference.element_ids[e]));
    common[e] = found == index.end() ? Presence::missing : present[found->second];
  }
  return common;
}

CommonMeshBuilder::CommonMeshBuilder(SimulationMesh reference, const std::string& run)
    : reference_(std::move(reference)), presence_(reference_.elements.size()) {
  check_mesh(reference_, run);
  (void)index_nodes(reference_.node_ids, run);
  for (std::size_t e = 0; e < presence_.size(); ++e) presence_[e] = usual(e);
}

void CommonMeshBuilder::keep(std::span<const Presence> common, const std::string& run) {
  std::vector<Unusual>& unusual = unusual_.emplace_back();
  const bool is_first = unusual_.size() == 1;
  bool erodes = false;
  for (std::size_t e = 0; e < presence_.size(); ++e) {
    presence_[e] = is_first ? common[e] : in_both(presence_[e], common[e]);
    if (common[e] == usual(e) || common[e] == Presence::missing) continue;
    unusual.push_back({static_cast<std::uint32_t>(e), common[e]});
    erodes = erodes || usual(e) == Presence::always;
  }
  if (erodes) eroding_runs_.push_back(run);
}

std::vector<std::uint8_t> CommonMeshBuilder::kept() const {
  std::vector<std::uint8_t> kept(presence_.size());
  std::ranges::transform(presence_, kept.begin(),
                         [](Presence p) { return p == Presence::always || p == Presence::sometimes ? 1 : 0; });
  return kept;
}

std::vector<std::uint8_t> CommonMeshBuilder::lack_elements() const {
  const std::vector<std::uint8_t> kept = this->kept();
  const auto exposed = std::count(kept.end() - static_cast<std::ptrdiff_t>(reference_.touching), kept.end(), 1);
  std::vector<std::uint8_t> lack;
  for (const std::vector<Unusual>& run : unusual_) {
    const bool lacks_outer = std::ranges::any_of(
        run, [&](const Unusual& u) { return kept[u.element] != 0 && usual(u.element) == Presence::always; });
    const auto always = std::ranges::count_if(run, [&](const Unusual& u) {  // faces between solids
      return kept[u.element] != 0 && u.presence == Presence::always;
    });
    lack.push_back(lacks_outer || always < exposed ? 1 : 0);
  }
  return lack;
}

MeshLosses CommonMeshBuilder::losses() const {
  MeshLosses losses;
  losses.runs = eroding_runs_;
  const std::vector<std::uint8_t> kept = this->kept();
  const std::size_t outer = kept.size() - reference_.touching;
  std::vector<std::uint8_t> before(reference_.nodes()), after(reference_.nodes());
  for (std::size_t e = 0; e < kept.size(); ++e) {
    if (e < outer && presence_[e] == Presence::never) ++losses.eroded;
    if (e < outer && presence_[e] == Presence::sometimes) ++losses.eroding;
    if (e < outer && presence_[e] == Presence::missing) ++losses.missing;
    if (e >= outer) losses.exposed += kept[e];
    for (const std::uint32_t node : reference_.elements[e]) {
      if (e < outer) before[node] = 1;
      if (kept[e]) after[node] = 1;
    }
  }
  losses.elements = static_cast<std::uint32_t>(outer);
  for (std::size_t node = 0; node < before.size(); ++node) {
    losses.nodes += before[node];
    losses.nodes_left_out += before[node] != 0 && after[node] == 0 ? 1u : 0u;
  }
  return losses;
}

CommonMesh CommonMeshBuilder::finish() const {
  const std::vector<std::uint8_t> is_kept = kept();
  std::vector<std::uint32_t> new_index(reference_.nodes(), nowhere);
  for (std::size_t e = 0; e < is_kept.size(); ++e)
    if (is_kept[e])
      for (const std::uint32_t node : reference_.elements[e]) new_index[node] = 0;

  CommonMesh common;
  for (std::size_t node = 0; node < new_index.size(); ++node) {
    if (new_index[node] == nowhere) continue;
    new_index[node] = static_cast<std::uint32_t>(common.node_ids.size());
    common.node_ids.push_back(reference_.node_ids[node]);
  }
  for (std::size_t e = 0; e < is_kept.size(); ++e) {
    if (!is_kept[e]) continue;
    const Quad& q = reference_.elements[e];
    common.elements.push_back({new_index[q[0]], new_index[q[1]], new_index[q[2]], new_index[q[3]]});
    common.element_ids.push_back(reference_.element_ids[e]);
    common.element_parts.push_back(reference_.element_parts[e]);
  }
  if (common.elements.empty())
    throw Error(Status::bad_input,
                "no element is common to all runs; do they show the same component with the same numbering? Leave out "
                "runs");
  return common;
}

MeshMapping map_common(const CommonMesh& common, const SimulationMesh& mesh, const std::string& run) {
  const NodeIndex nodes = index_nodes(mesh.node_ids, run);
  const ElementIndex elements = index_elements(mesh);
  MeshMapping mapping;
  for (const std::uint32_t id : common.node_ids) {
    const auto found = nodes.find(id);
    if (found == nodes.end())
      throw Error(Status::bad_input, "run " + run + ": node " + std::to_string(id) + " is missing");
    mapping.nodes.push_back(found->second);
  }
  for (std::size_t e = 0; e < common.elements.size(); ++e) {
    const auto found = elements.find(key_of(common.node_ids, common.elements[e], common.element_ids[e]));
    if (found == elements.end())
      throw Error(Status::bad_input,
                  "run " + run + ": element " + std::to_string(common.element_ids[e]) + " is missing");
    mapping.elements.push_back(found->second);
  }
  return mapping;
}
}  // namespace lbea::bake
