#include "precompute/survey/reference.hpp"

#include "precompute/basis/mesh_laplacian.hpp"
#include "precompute/survey/surface_continuation.hpp"
#include "precompute/work/bake_plan.hpp"

#include <functional>
#include <unordered_set>

namespace lbea::bake {
namespace {
using Mask = std::vector<std::uint8_t>;
using Ids = std::unordered_set<std::uint32_t>;

Ids as_set(std::span<const std::uint32_t> ids) { return {ids.begin(), ids.end()}; }

void check_exist(const std::vector<std::uint32_t>& wanted, std::span<const std::uint32_t> existing,
                 const std::string& what) {
  const Ids known = as_set(existing);
  for (const std::uint32_t id : wanted)
    if (!known.contains(id))
      throw Error(Status::bad_config, "the region names " + what + " " + std::to_string(id) +
                                          ", which the reference run does not have; correct the region");
}

bool inside(const Box& box, const float* p) {
  for (std::size_t axis = 0; axis < 3; ++axis)
    if (!(double{p[axis]} >= box.min[axis] && double{p[axis]} <= box.max[axis])) return false;
  return true;
}

Mask chosen_nodes(const CommonMesh& mesh, std::span<const float> positions, const RegionCriteria& criteria) {
  const Ids wanted = as_set(criteria.node_ids);
  Mask chosen(mesh.node_ids.size(), 1);
  for (std::size_t i = 0; i < chosen.size(); ++i) {
    const bool listed = wanted.empty() || wanted.contains(mesh.node_ids[i]);
    const bool visible = criteria.visible.empty() || criteria.visible[i];
    chosen[i] = listed && visible && (!criteria.box || inside(*criteria.box, &positions[3 * i]));
  }
  return chosen;
}

std::vector<Quad> chosen_elements(const CommonMesh& mesh, const RegionCriteria& criteria, const Mask& nodes) {
  const std::vector<std::uint32_t>& parts = criteria.parts;
  std::vector<Quad> chosen;
  for (std::size_t e = 0; e < mesh.elements.size(); ++e) {
    if (!criteria.present.empty() && criteria.present[e] == 0) continue;
    const Quad& q = mesh.elements[e];
    const bool of_part = parts.empty() || std::find(parts.begin(), parts.end(), mesh.element_parts[e]) != parts.end();
    if (of_part && std::all_of(q.begin(), q.end(), [&](std::uint32_t node) { return nodes[node] != 0; }))
      chosen.push_back(q);
  }
  return chosen;
}

/// Removes the elements around nodes that have no area around them, for which no basis exists; returns how many.
std::size_t remove_flat(std::vector<Quad>& elements, std::span<const float> positions) {
  const std::size_t all = elements.size();
  for (std::size_t left = 0; left != elements.size();) {
    left = elements.size();
    const Eigen::VectorXd mass = mesh_laplacian(positions, elements).mass;
    std::erase_if(elements, [&](const Quad& q) {
      return std::ranges::any_of(q, [&](std::uint32_t node) { return !(mass[node] > 0); });
    });
  }
  return all - elements.size();
}

/// Reads states of the reference run.
class ReferenceRun {
 public:
  explicit ReferenceRun(const BakePlan& plan)
      : name_(plan.ensemble.runs[plan.ensemble.reference_run].name),
        reader_(plan.ensemble.runs[plan.ensemble.reference_run].open()),
        mapping_(map_common(plan.survey.mesh, reader_->mesh(), name_)),
        continuation_(reader_->mesh(), plan.survey.mesh, mapping_),
        time_factor_(plan.description.time_factor) {
    const EnsembleDescription& description = plan.description;
    if (description.impact_step >= reader_->states())
      throw Error(Status::bad_config, "the impact is at state " + std::to_string(description.impact_step) +
                                          ", but run " + name_ + " has " + std::to_string(reader_->states()) +
                                          " states");
    impact_time_ = reader_->time_s(description.impact_step);
  }

  ReferenceState at(std::uint32_t step) {
    reader_->read(step, state_);
    check_state(*reader_, state_, name_, step);
    continuation_.apply(state_);
    ReferenceState reference{(reader_->time_s(step) - impact_time_) * time_factor_, {}};
    for (const std::uint32_t node : mapping_.nodes) {
      const float* p = &state_.positions[3 * std::size_t{node}];
      reference.positions.insert(reference.positions.end(), p, p + 3);
    }
    const std::vector<std::uint8_t> surface = exposed_elements(reader_->mesh(), state_.alive);
    for (const std::uint32_t element : mapping_.elements) reference.present.push_back(surface[element]);
    return reference;
  }

 private:
  const std::string& name_;
  std::unique_ptr<SimulationReader> reader_;
  MeshMapping mapping_;
  SurfaceContinuation continuation_;
  double time_factor_;
  double impact_time_ = 0;
  SimulationState state_;
};

CommonMesh surface_of(const CommonMesh& mesh, const Mask& present) {
  CommonMesh surface{mesh.node_ids, {}, {}, {}};
  for (std::size_t e = 0; e < present.size(); ++e) {
    if (present[e] == 0) continue;
    surface.elements.push_back(mesh.elements[e]);
    surface.element_ids.push_back(mesh.element_ids[e]);
    surface.element_parts.push_back(mesh.element_parts[e]);
  }
  return surface;
}

/// states: the reference meshes.
ObservedRegion choose_region(const RegionDescription& region, const BakeOptions& options, const Survey& survey,
                             const ReferenceState& impact, const std::vector<ReferenceState>& states) {
  RegionCriteria criteria{region.parts, region.box, region.node_ids, {}, impact.present};
  if (options.visible_nodes)
    criteria.visible = options.visible_nodes(surface_of(survey.mesh, impact.present), impact.positions);
  for (const ReferenceState& state : states)
    std::ranges::transform(criteria.present, state.present, criteria.present.begin(), std::bit_and{});
  return observed_region(survey.mesh, impact.positions, criteria, survey.reference_node_ids);
}

/// (a) impact: one state; (b) over time: each used state of the reference run.
std::vector<ReferenceState> reference_states(ReferenceMode mode, ReferenceRun& run, const ReferenceState& impact,
                                             const std::vector<std::uint32_t>& steps) {
  if (mode == ReferenceMode::impact) return {impact};
  std::vector<ReferenceState> states;
  for (const std::uint32_t step : steps) states.push_back(run.at(step));
  if (!std::ranges::is_sorted(states, {}, &ReferenceState::time_s))
    throw Error(Status::bad_input, "the times of the reference run do not ascend");
  return states;
}
}  // namespace

ObservedRegion observed_region(const CommonMesh& mesh, std::span<const float> positions, const RegionCriteria& criteria,
                               std::span<const std::uint32_t> all_node_ids) {
  check_exist(criteria.node_ids, all_node_ids, "node");
  check_exist(criteria.parts, mesh.element_parts, "part");
  if (!criteria.visible.empty() && criteria.visible.size() != mesh.node_ids.size())
    throw Error(Status::bad_config, "the visibility mask has " + std::to_string(criteria.visible.size()) +
                                        " entries for " + std::to_string(mesh.node_ids.size()) + " nodes");
  if (!criteria.visible.empty() && std::ranges::count(criteria.visible, 0) == std::ssize(criteria.visible))
    throw Error(
        Status::bad_config,
        "no sensor sees the component at impact; check T_reference_sensor, focal length and image size, or give a "
        "region");

  ObservedRegion region;
  region.elements = chosen_elements(mesh, criteria, chosen_nodes(mesh, positions, criteria));
  region.without_area = remove_flat(region.elements, positions);
  if (region.elements.empty())
    throw Error(Status::bad_config,
                "no element of the component lies in the region with all its nodes; widen the region");

  std::vector<std::uint32_t> new_index(mesh.node_ids.size(), 0);
  for (const Quad& q : region.elements)
    for (const std::uint32_t node : q) new_index[node] = 1;
  for (std::uint32_t node = 0; node < new_index.size(); ++node) {
    if (new_index[node] == 0) continue;
    new_index[node] = static_cast<std::uint32_t>(region.nodes.size());
    region.nodes.push_back(node);
  }
  for (Quad& q : region.elements)
    for (std::uint32_t& node : q) node = new_index[node];
  return region;
}

Reference choose_reference(const BakePlan& plan, const BakeOptions& options) {
  ReferenceRun run(plan);
  const ReferenceState impact = run.at(plan.description.impact_step);
  std::vector<ReferenceState> states =
      reference_states(plan.description.mode, run, impact, plan.survey.runs[plan.ensemble.reference_run].steps);
  ObservedRegion region = choose_region(plan.description.region, options, plan.survey, impact, states);
  return {std::move(region), std::move(states)};
}
}  // namespace lbea::bake
