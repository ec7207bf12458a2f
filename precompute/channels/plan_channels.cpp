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
  if (is_filtered && (channel.cfc < 1 || channel.cfc > most_cfc))
    refuse_channel(where + "needs the class of its filter, from 1 to 1000, like cfc = 60");
  if (!is_filtered && channel.cfc != 0) refuse_channel(where + "is not filtered; remove cfc");
  if (channel.kind == ChannelKind::distance && channel.component != ChannelComponent::resultant)
    refuse_channel(where + "is a distance, which has no components; remove component");
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
                   (is_left_out ? ", which not all runs have on elements that do not erode; choose another one"
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
  for (const ChannelDescription& channel : plan.description.channels)
    plan.channels.push_back(planned(channel, finder, unit));
}

}  // namespace lbea::bake
