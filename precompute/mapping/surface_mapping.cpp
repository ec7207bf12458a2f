#include "precompute/mapping/surface_mapping.hpp"

#include "precompute/mapping/smooth_difference.hpp"
#include "precompute/work/archive.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <utility>

namespace lbea::bake {
// Not in the unnamed namespace: the archive finds it by argument-dependent lookup.
static void members(auto& a, CarriedNode& n) { a(n.nodes, n.shares, n.element); }

namespace {
using Sources = std::array<std::uint32_t, ReferencePlaces::quarters>;

std::string number(double value) {
  std::array<char, 32> text{};
  std::snprintf(text.data(), text.size(), "%.3g", value);
  return text.data();
}

/// Where the places of the reference surface are on the run's.
class Finder {
 public:
  Finder(const ReferencePlaces& reference, const PartSurfaces& run, double reach)
      : reference_(reference), run_(run), difference_(reference, run), reach_(reach) {
    nodes_.resize(reference.mesh().nodes());
    for (std::size_t node = 0; node < nodes_.size(); ++node)
      if (reference.has_node(node)) nodes_[node] = find(reference.node(node), std::numeric_limits<double>::infinity());
  }

  [[nodiscard]] const std::vector<SurfacePlace>& nodes() const noexcept { return nodes_; }
  [[nodiscard]] bool has_nodes(std::size_t element) const {
    return std::ranges::all_of(reference_.mesh().elements[element],
                               [&](std::uint32_t node) { return nodes_[node].distance <= reach_; });
  }
  /// The run's elements at the quarters of an element; nothing when one is out of reach.
  [[nodiscard]] std::optional<Sources> sources(std::size_t element) const {
    Sources sources{};
    for (std::size_t corner = 0; corner < sources.size(); ++corner) {
      const SurfacePlace place = find(reference_.quarter(element, corner), reach_);
      if (!place.found()) return std::nullopt;
      sources[corner] = place.element;
    }
    return sources;
  }
  [[nodiscard]] double largest_shift() const {
    double largest = 0;
    for (std::size_t node = 0; node < nodes_.size(); ++node) {
      if (!reference_.has_node(node)) continue;
      const auto from = reference_.node(node).point, to = difference_.moved(from);
      largest = std::max(largest, std::hypot(to[0] - from[0], to[1] - from[1], to[2] - from[2]));
    }
    return largest;
  }

 private:
  [[nodiscard]] SurfacePlace find(WantedPlace wanted, double reach) const {
    wanted.point = difference_.moved(wanted.point);
    return run_.nearest(wanted, reach);
  }

  const ReferencePlaces& reference_;
  const PartSurfaces& run_;
  SmoothDifference difference_;
  double reach_;
  std::vector<SurfacePlace> nodes_;
};

/// Numbers the nodes that elements use anew, in their order; the others become `mesh.nodes()`.
std::vector<std::uint32_t> numbered(const SimulationMesh& mesh, const std::vector<std::uint32_t>& elements) {
  std::vector<std::uint32_t> number(mesh.nodes(), static_cast<std::uint32_t>(mesh.nodes()));
  for (const std::uint32_t e : elements)
    for (const std::uint32_t node : mesh.elements[e]) number[node] = 0;
  for (std::uint32_t next = 0; std::uint32_t & n : number)
    if (n == 0) n = next++;
  return number;
}

void add_nodes(SurfaceMapping& mapping, const SimulationMesh& reference, const SimulationMesh& run,
               const std::vector<std::uint32_t>& numbers, const std::vector<SurfacePlace>& places) {
  for (std::size_t node = 0; node < numbers.size(); ++node) {
    if (numbers[node] == numbers.size()) continue;
    mapping.nodes.push_back({places[node].nodes, places[node].shares, places[node].element});
    mapping.mesh.node_ids.push_back(reference.node_ids[node]);
  }
  mapping.mesh.has_solver_ids = reference.has_solver_ids;
  carry(mapping.nodes, run.positions, mapping.mesh.positions);
}

void add_elements(SurfaceMapping& mapping, const SimulationMesh& reference, const std::vector<std::uint32_t>& elements,
                  const std::vector<std::uint32_t>& numbers) {
  for (const std::uint32_t e : elements) {
    Quad element = reference.elements[e];
    for (std::uint32_t& node : element) node = numbers[node];
    mapping.mesh.elements.push_back(element);
    mapping.mesh.element_ids.push_back(reference.element_ids[e]);
    mapping.mesh.element_parts.push_back(reference.element_parts[e]);
  }
}

/// Nodes with and without a place on the run's surface.
struct NodeCounts {
  std::size_t placed = 0, lost = 0;
};

/// Distances of the nodes of these elements.
NodeCounts add_distances(MappingReport& report, const SimulationMesh& reference,
                         const std::vector<std::uint32_t>& elements, const std::vector<SurfacePlace>& places) {
  std::vector<std::uint8_t> is_counted(reference.nodes(), 0);
  NodeCounts counts;
  double sum = 0;
  for (const std::uint32_t e : elements)
    for (const std::uint32_t node : reference.elements[e]) {
      if (std::exchange(is_counted[node], 1) != 0) continue;
      ++(places[node].found() ? counts.placed : counts.lost);
      if (!places[node].found()) continue;
      sum += places[node].distance;
      if (counts.placed > 1 && places[node].distance <= report.largest) continue;
      report.largest = places[node].distance;
      report.worst_element = reference.element_ids[e];
    }
  report.mean = counts.placed > 0 ? sum / static_cast<double>(counts.placed) : 0;
  return counts;
}

/// Where all nodes of the reference mesh are, for a refusal.
std::string described(const MappingReport& report, const NodeCounts& counts, const std::string& unit) {
  std::string text;
  if (counts.lost > 0)
    text = std::to_string(counts.lost) + " of its nodes find no surface of their part that faces their way. ";
  if (counts.placed > 0)
    text += (counts.lost > 0 ? "The others" : "All nodes") + std::string(" are ") + number(report.mean) + " " + unit +
            " off in the mean and " + number(report.largest) + " " + unit + " at most, at element " +
            std::to_string(report.worst_element) + ". ";
  return text;
}

[[noreturn]] void refuse(MappingReport report, const Finder& finder, const SimulationMesh& reference, double distance,
                         const MappingSettings& settings, const std::string& unit) {
  std::vector<std::uint32_t> all(report.elements);
  for (std::uint32_t e = 0; e < report.elements; ++e) all[e] = e;
  const NodeCounts counts = add_distances(report, reference, all, finder.nodes());
  const auto length = [&](double value) { return number(value) + " " + unit; };
  throw Error(Status::bad_input,
              "its mesh of " + std::to_string(report.run_elements) + " elements is another one, and " +
                  std::to_string(report.mapped_elements) + " of the reference run's " +
                  std::to_string(report.elements) + " elements are on it within " + length(distance) +
                  "; the mapping needs " + number(100 * settings.share) + " %, within " +
                  length(settings.mean_distance_in(unit)) + " in the mean. " + described(report, counts, unit) +
                  "Is the run another component, or in another place, direction or unit? Set mapping.distance, share "
                  "or parts, or leave it out");
}
}  // namespace

void carry(std::span<const CarriedNode> nodes, std::span<const float> run, std::vector<float>& into) {
  into.resize(3 * nodes.size());
  for (std::size_t i = 0; i < nodes.size(); ++i)
    for (std::size_t axis = 0; axis < 3; ++axis) {
      double sum = 0;
      for (std::size_t k = 0; k < 3; ++k)
        if (nodes[i].shares[k] != 0) sum += nodes[i].shares[k] * double{run[3 * std::size_t{nodes[i].nodes[k]} + axis]};
      into[3 * i + axis] = static_cast<float>(sum);
    }
}

std::vector<SurfacePlace> places_of_nodes(const SimulationMesh& reference, const SimulationMesh& run,
                                          const MappingSettings& settings) {
  const ReferencePlaces surface(reference);
  const PartSurfaces target(reference, run, settings);
  return Finder(surface, target, std::numeric_limits<double>::infinity()).nodes();
}

SurfaceMapping map_surface(const SimulationMesh& reference, const SimulationMesh& run, const MappingSettings& settings,
                           const std::string& unit) {
  const double distance = settings.distance_in(unit);
  const ReferencePlaces surface(reference);
  const PartSurfaces target(reference, run, settings);
  const Finder finder(surface, target, distance);
  SurfaceMapping mapping;
  MappingReport& report = mapping.report;
  report.run_elements = static_cast<std::uint32_t>(run.elements.size() - run.touching);
  report.elements = static_cast<std::uint32_t>(surface.elements());
  report.tells_parts = target.tells_parts();
  std::vector<std::uint32_t> elements;
  for (std::uint32_t e = 0; e < surface.elements(); ++e) {
    const auto sources = finder.has_nodes(e) ? finder.sources(e) : std::nullopt;
    if (!sources) continue;
    elements.push_back(e);
    mapping.sources.push_back(*sources);
  }
  report.mapped_elements = static_cast<std::uint32_t>(elements.size());
  add_distances(report, reference, elements, finder.nodes());
  if (elements.empty() || report.mapped_elements < settings.share * report.elements ||
      !(report.mean <= settings.mean_distance_in(unit)))
    refuse(report, finder, reference, distance, settings, unit);
  const std::vector<std::uint32_t> numbers = numbered(reference, elements);
  add_nodes(mapping, reference, run, numbers, finder.nodes());
  add_elements(mapping, reference, elements, numbers);
  report.shift = finder.largest_shift();
  report.key = key_of(mapping.mesh.node_ids, mapping.mesh.elements, mapping.nodes, mapping.sources);
  return mapping;
}
}  // namespace lbea::bake
