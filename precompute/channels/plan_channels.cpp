#include "precompute/channels/plan_channels.hpp"

#include "precompute/work/bake_plan.hpp"
#include "runtime/src/channels/learned_channels.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <set>

namespace lbea::bake {
namespace {

using Eigen::Vector3d;

[[noreturn]] void refuse_channel(const std::string& sentence) { throw Error(Status::bad_config, sentence); }

std::string rounded(double length) {
  char text[32];
  std::snprintf(text, sizeof(text), "%.4g", length);
  return text;
}

bool is_control(char c) { return static_cast<unsigned char>(c) < 0x20 || c == 0x7f; }

void check_names(const std::vector<ChannelDescription>& channels) {
  if (channels.size() > most_channels)
    refuse_channel(std::to_string(channels.size()) + " channels are more than a model holds; give at most " +
                   std::to_string(most_channels));
  std::set<std::string> names;
  for (std::size_t i = 0; i < channels.size(); ++i) {
    const std::string& name = channels[i].name;
    if (name.empty()) refuse_channel("channel " + std::to_string(i + 1) + " has no name; give one");
    if (std::ranges::any_of(name, is_control))
      refuse_channel("the name of channel " + std::to_string(i + 1) + " has control characters; give another one");
    if (!names.insert(name).second) refuse_channel("two channels are called '" + name + "'; rename one");
  }
}

void check_kind(const ChannelDescription& channel, const std::string& where) {
  const bool is_filtered = channel.kind == ChannelKind::velocity || channel.kind == ChannelKind::acceleration;
  constexpr std::uint32_t most_cfc = 1000;  // the highest class of SAE J211-1
  const bool is_statistic = is_of_field(channel.kind), is_history = channel.kind == ChannelKind::history;
  if (channel.cfc > most_cfc || (is_filtered && channel.cfc == 0))
    refuse_channel(where + "needs the class of its filter, from 1 to 1000, like cfc = 60");
  if (!is_filtered && !is_history && channel.cfc != 0) refuse_channel(where + "is not filtered; remove cfc");
  if ((!is_of_nodes(channel.kind) || channel.kind == ChannelKind::distance) &&
      channel.component != ChannelComponent::resultant)
    refuse_channel(where + "is a " + std::string(to_string(channel.kind)) +
                   ", which has no components; remove component");
  if (is_history && (channel.unit.empty() || std::ranges::any_of(channel.unit, is_control)))
    refuse_channel(where + "needs a unit, like unit = \"J\": the runs do not say it");
  if (!is_history && !(channel.unit.empty() && channel.history.name.empty()))
    refuse_channel(where + "is not a history; remove history, part, wall and unit");
  if (is_statistic && channel.field.empty()) refuse_channel(where + "needs a field, like field = \"plastic_strain\"");
  if (!is_statistic && !(channel.field.empty() && channel.parts.empty() && channel.elements.empty()))
    refuse_channel(where + "is not of a field; remove field, parts and elements");
  if (const std::size_t needed = nodes_of(channel.kind); channel.points.size() != needed)
    refuse_channel(where + "needs " + std::to_string(needed) + (needed == 1 ? " point, not " : " points, not ") +
                   std::to_string(channel.points.size()));
  if (channel.reach && !(*channel.reach > 0)) refuse_channel(where + "has a reach that is not positive");
}

class NodeFinder {
 public:
  NodeFinder(const CommonMesh& mesh, const std::vector<std::uint32_t>& all_ids, const Reference& reference,
             const std::string& unit)
      : mesh_(mesh), all_ids_(all_ids), reference_(reference), unit_(unit) {}

  /// The node, and its distance from a point.
  [[nodiscard]] std::pair<std::uint32_t, double> find(const ChannelPoint& point, std::optional<double> reach,
                                                      const std::string& where) const {
    if (point.is_node) return {find(point.node, where), 0};
    const Vector3d place(point.position[0], point.position[1], point.position[2]);
    const auto from = [&](std::uint32_t node) { return (position(node) - place).norm(); };
    const std::uint32_t node = *std::ranges::min_element(reference_.region.nodes, {}, from);
    const double limit = reach ? *reach : mean_edge(node);
    if (from(node) > limit)
      refuse_channel(where + "has a point that is " + rounded(from(node)) + " " + unit_ +
                     " from the nearest vertex of the observed surface, node " + std::to_string(mesh_.node_ids[node]) +
                     "; more than " + rounded(limit) + " " + unit_ + " are refused: correct the point or set reach");
    return {node, from(node)};
  }

 private:
  [[nodiscard]] std::uint32_t find(std::uint32_t id, const std::string& where) const {
    const auto found = std::ranges::find(mesh_.node_ids, id);
    if (found != mesh_.node_ids.end()) return static_cast<std::uint32_t>(found - mesh_.node_ids.begin());
    const bool is_left_out = std::ranges::find(all_ids_, id) != all_ids_.end();
    refuse_channel(where + "names node " + std::to_string(id) +
                   (is_left_out ? ", which not all runs have on the surface; choose another one"
                                : ", which the reference run does not have; correct it"));
  }
  [[nodiscard]] Vector3d position(std::uint32_t node) const {
    const float* p = &reference_.states.front().positions[std::size_t{3} * node];
    return {double{p[0]}, double{p[1]}, double{p[2]}};
  }
  /// Of the elements around the node.
  [[nodiscard]] double mean_edge(std::uint32_t node) const {
    double sum = 0, count = 0;
    for (const Quad& element : mesh_.elements) {
      if (std::ranges::find(element, node) == element.end()) continue;
      for (std::size_t i = 0; i < element.size(); ++i) {
        const std::uint32_t a = element[i], b = element[(i + 1) % element.size()];
        if (a != b) sum += (position(a) - position(b)).norm(), ++count;
      }
    }
    return count > 0 ? sum / count : 0;
  }

  const CommonMesh& mesh_;
  const std::vector<std::uint32_t>& all_ids_;
  const Reference& reference_;
  const std::string& unit_;
};

std::uint32_t find_field(const std::vector<SimulationField>& fields, const std::string& name,
                         const std::string& where) {
  const auto found = std::ranges::find(fields, name, &SimulationField::name);
  if (found != fields.end()) return static_cast<std::uint32_t>(found - fields.begin());
  std::string known;
  for (const SimulationField& field : fields) known += (known.empty() ? "" : ", ") + field.name;
  refuse_channel(where + "names field '" + name + "', which the model does not store; it stores " +
                 (known.empty() ? "none" : known) + ": correct it, or add it to fields");
}

void check_known(const std::vector<std::uint32_t>& ids, std::vector<std::uint32_t> known, const std::string& what) {
  std::ranges::sort(known);
  for (const std::uint32_t id : ids)
    if (!std::ranges::binary_search(known, id))
      refuse_channel(what + std::to_string(id) + ", which the surface that all runs have does not have; correct it");
}

/// Of the parts and with the ids; all if neither is given.
std::vector<std::uint32_t> chosen_elements(const ChannelDescription& channel, const CommonMesh& mesh,
                                           const std::string& where) {
  check_known(channel.parts, mesh.element_parts, where + "names part ");
  check_known(channel.elements, mesh.element_ids, where + "names element ");
  const std::set<std::uint32_t> parts(channel.parts.begin(), channel.parts.end()),
      ids(channel.elements.begin(), channel.elements.end());
  std::vector<std::uint32_t> chosen;
  for (std::uint32_t e = 0; e < mesh.elements.size(); ++e)
    if ((parts.empty() && ids.empty()) || parts.contains(mesh.element_parts[e]) || ids.contains(mesh.element_ids[e]))
      chosen.push_back(e);
  return chosen;
}

/// Of a quad along its nodes 0-2.
double area_of(const Quad& element, std::span<const float> positions) {
  const auto at = [&](std::size_t i) {
    const float* p = &positions[std::size_t{3} * element[i]];
    return Vector3d(double{p[0]}, double{p[1]}, double{p[2]});
  };
  const Vector3d diagonal = at(2) - at(0);
  return ((at(1) - at(0)).cross(diagonal).norm() + diagonal.cross(at(3) - at(0)).norm()) / 2;
}

PlannedChannel planned_statistic(const ChannelDescription& channel, const Survey& survey, const Reference& reference) {
  const std::string where = "channel '" + channel.name + "' ";
  check_kind(channel, where);
  const std::uint32_t field = find_field(survey.fields, channel.field, where);
  PlannedChannel result{channel.name, survey.fields[field].unit, channel.kind, channel.component, 0, {}, {}, field};
  result.elements = chosen_elements(channel, survey.mesh, where);
  double sum = 0;
  for (const std::uint32_t element : result.elements)
    sum += result.areas.emplace_back(area_of(survey.mesh.elements[element], reference.states.front().positions));
  if (channel.kind == ChannelKind::mean && !(sum > 0))
    refuse_channel(where + "has elements without area at impact; choose other ones");
  return result;
}

PlannedChannel planned_history(const ChannelDescription& channel, std::uint32_t index) {
  check_kind(channel, "channel '" + channel.name + "' ");
  PlannedChannel result{channel.name, channel.unit, channel.kind, channel.component, channel.cfc, {}, {}};
  result.history = channel.history;
  result.history_index = index;
  return result;
}

PlannedChannel planned(const ChannelDescription& channel, const NodeFinder& finder, const std::string& length_unit) {
  const std::string where = "channel '" + channel.name + "' ";
  check_kind(channel, where);
  PlannedChannel result{
      channel.name, unit_of(channel.kind, length_unit), channel.kind, channel.component, channel.cfc, {}, {}};
  for (const ChannelPoint& point : channel.points) {
    const auto [node, distance] = finder.find(point, channel.reach, where);
    if (std::ranges::find(result.nodes, node) != result.nodes.end())
      refuse_channel(where + "has two points at the same node; choose different ones");
    result.nodes.push_back(node);
    result.distances.push_back(distance);
  }
  return result;
}

}  // namespace

void plan_channels(BakePlan& plan, const Reference& reference) {
  const std::string& unit = plan.description.length_unit;
  check_names(plan.description.channels);
  const NodeFinder finder(plan.survey.mesh, plan.survey.reference_node_ids, reference, unit);
  plan.channels.clear();
  std::uint32_t histories = 0;
  for (const ChannelDescription& channel : plan.description.channels)
    if (channel.kind == ChannelKind::history)
      plan.channels.push_back(planned_history(channel, histories++));
    else
      plan.channels.push_back(is_of_field(channel.kind) ? planned_statistic(channel, plan.survey, reference)
                                                        : planned(channel, finder, unit));
}

}  // namespace lbea::bake
