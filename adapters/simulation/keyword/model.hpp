// Nodes and elements of all files of an LS-DYNA keyword input.
#pragma once

#include "adapters/simulation/grid/grid.hpp"
#include "adapters/simulation/keyword/transform.hpp"

#include <deque>
#include <unordered_map>

namespace lbea::io::keyword {
class Model {
 public:
  /// Positions and ids get the transform of the file that the card is in.
  void add_node(const Cards& cards, const Transform& transform, std::string_view id,
                const std::array<float, 3>& position);
  void begin_element(const Cards& cards, const Transform& transform, const std::vector<std::string_view>& card,
                     grid::CellKind kind, std::size_t file);
  /// The kind of the last element, and its nodes, which may be defined later.
  void set_kind(grid::CellKind kind) { kinds_.back() = kind; }
  void add_corner(const Cards& cards, const Transform& transform, std::uint32_t node);

  [[nodiscard]] std::size_t elements() const noexcept { return kinds_.size(); }
  /// `files`: names by the index that begin_element() got.
  [[nodiscard]] grid::Grid finish(const std::deque<std::string>& files);

 private:
  struct Place {
    std::size_t file, line;
  };
  grid::Grid grid_;
  std::unordered_map<std::uint32_t, std::uint32_t> node_points_;
  std::vector<std::uint32_t> node_ids_, element_ids_, parts_, corners_;
  std::vector<std::size_t> ends_{0};
  std::vector<grid::CellKind> kinds_;
  std::vector<Place> places_;
};
}  // namespace lbea::io::keyword
