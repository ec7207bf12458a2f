#include "adapters/simulation/keyword/model.hpp"

namespace lbea::io::keyword {
namespace {
/// Ids run from 1 to 4,294,967,294; 0 stays 0, as it names nothing.
std::uint32_t shifted(const Cards& cards, std::uint32_t id, std::int64_t offset) {
  const std::int64_t sum = std::int64_t{id} + offset;
  if (id == 0 || offset == 0) return id;
  if (sum < 1 || sum > 0xfffffffe)
    cards.fail("id " + std::to_string(id) + " with the offset " + std::to_string(offset) +
               " of *INCLUDE_TRANSFORM is " + std::to_string(sum) + ", which is not an id");
  return static_cast<std::uint32_t>(sum);
}
}  // namespace

void Model::add_node(const Cards& cards, const Transform& transform, std::string_view field,
                     const std::array<float, 3>& position) {
  const std::uint32_t id = shifted(cards, cards.id(field), transform.node_offset);
  if (!node_points_.emplace(id, static_cast<std::uint32_t>(node_ids_.size())).second)
    cards.fail("node " + std::to_string(id) + " is defined twice");
  node_ids_.push_back(id);
  if (transform.motion == Motion()) {
    grid_.positions.insert(grid_.positions.end(), position.begin(), position.end());
    return;
  }
  for (const double value : transform.motion({position[0], position[1], position[2]}))
    grid_.positions.push_back(static_cast<float>(value));
}

void Model::begin_element(const Cards& cards, const Transform& transform, const std::vector<std::string_view>& card,
                          grid::CellKind kind, std::size_t file) {
  kinds_.push_back(kind);
  element_ids_.push_back(shifted(cards, cards.id(card[0]), transform.element_offset));
  parts_.push_back(shifted(cards, cards.id(card[1]), transform.part_offset));
  places_.push_back({file, cards.line()});
  ends_.push_back(corners_.size());
}

void Model::add_corner(const Cards& cards, const Transform& transform, std::uint32_t node) {
  corners_.push_back(shifted(cards, node, transform.node_offset));
  ends_.back() = corners_.size();
}

grid::Grid Model::finish(const std::deque<std::string>& files) {
  std::vector<std::uint32_t> points;
  for (std::size_t e = 0; e < kinds_.size(); ++e) {
    points.clear();
    for (std::size_t at = ends_[e]; at < ends_[e + 1]; ++at) {
      const auto point = node_points_.find(corners_[at]);
      if (point == node_points_.end())
        throw Error{Status::bad_input, files[places_[e].file] + ", line " + std::to_string(places_[e].line) +
                                           ": node " + std::to_string(corners_[at]) + " is not in " +
                                           (files.size() == 1 ? "this file; give a file that also has the nodes"
                                                              : "these files; give the file that includes all")};
      points.push_back(point->second);
    }
    grid_.cells.add(kinds_[e], points);
  }
  grid_.point_arrays.push_back({"NODE_ID", 1, {node_ids_.begin(), node_ids_.end()}});
  grid_.cell_arrays.push_back({"ELEMENT_ID", 1, {element_ids_.begin(), element_ids_.end()}});
  grid_.cell_arrays.push_back({"PART_ID", 1, {parts_.begin(), parts_.end()}});
  return std::move(grid_);
}
}  // namespace lbea::io::keyword
