#include "adapters/simulation/grid/joined_points.hpp"

#include "adapters/simulation/grid/grid_mesh.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <unordered_map>

namespace lbea::io::grid {
namespace {
using Key = std::array<std::uint32_t, 3>;

struct KeyHash {
  std::size_t operator()(const Key& key) const noexcept {
    std::size_t hash = 0;
    for (const std::uint32_t word : key) hash = (hash ^ word) * 0x9e3779b97f4a7c15ull;
    return hash;
  }
};

std::span<const float> position(const Grid& grid, std::size_t point) {
  return std::span(grid.positions).subspan(3 * point, 3);
}

/// Adding 0 makes -0 and 0 equal.
Key coordinates_key(const Grid& grid, std::size_t point) {
  const auto p = position(grid, point);
  return {std::bit_cast<std::uint32_t>(p[0] + 0.0f), std::bit_cast<std::uint32_t>(p[1] + 0.0f),
          std::bit_cast<std::uint32_t>(p[2] + 0.0f)};
}

std::vector<std::uint32_t> itself(std::size_t points) {
  std::vector<std::uint32_t> all(points);
  for (std::uint32_t p = 0; p < points; ++p) all[p] = p;
  return all;
}

std::vector<std::uint32_t> joined_soup(const Grid& grid) {
  std::unordered_map<Key, std::uint32_t, KeyHash> first;
  std::vector<std::uint32_t> joined(grid.points());
  for (std::uint32_t p = 0; p < joined.size(); ++p)
    joined[p] = first.emplace(coordinates_key(grid, p), p).first->second;
  return joined;
}

/// Node ids are unique in a mesh; id 0 marks points that are not nodes of the model.
std::vector<std::uint32_t> joined_by_id(const Array& ids) {
  std::unordered_map<double, std::uint32_t> first;
  std::vector<std::uint32_t> joined = itself(ids.values.size());
  for (std::uint32_t p = 0; p < joined.size(); ++p)
    if (ids.values[p] > 0) joined[p] = first.emplace(ids.values[p], p).first->second;
  return joined;
}

/// Within one piece, points at the same place are different nodes, and which of them another piece repeats is unknown.
std::vector<std::uint32_t> joined_pieces(const Grid& grid) {
  struct Place {
    std::uint32_t first, piece;
    bool is_ambiguous;
  };
  std::unordered_map<Key, Place, KeyHash> places;
  std::uint32_t point = 0;
  for (std::uint32_t piece = 0; piece < grid.piece_ends.size(); ++piece)
    for (; point < grid.piece_ends[piece]; ++point) {
      const auto [at, is_new] = places.emplace(coordinates_key(grid, point), Place{point, piece, false});
      if (is_new) continue;
      at->second.is_ambiguous |= at->second.piece == piece;
      at->second.piece = piece;
    }
  std::vector<std::uint32_t> joined = itself(grid.points());
  for (std::uint32_t p = 0; p < joined.size(); ++p)
    if (const Place& place = places.at(coordinates_key(grid, p)); !place.is_ambiguous) joined[p] = place.first;
  return joined;
}

/// Processes that share a node may round its position differently.
float tolerance(const Grid& grid) {
  constexpr float share = 1e-5f;
  if (grid.is_triangle_soup) return 0;
  float largest = 0;
  for (const float value : grid.positions)
    if (std::isfinite(value)) largest = std::max(largest, std::abs(value));
  return share * largest;
}
}  // namespace

std::vector<std::uint32_t> joined_points(const Grid& grid) {
  if (grid.is_triangle_soup) return joined_soup(grid);
  if (grid.piece_ends.size() < 2) return {};
  const Array* ids = node_ids_of(grid);
  return ids != nullptr ? joined_by_id(*ids) : joined_pieces(grid);
}

void require_joined(const Grid& grid, const std::vector<std::uint32_t>& joined, const std::string& file,
                    const std::string& first) {
  const float most = tolerance(grid);
  for (std::uint32_t p = 0; p < joined.size(); ++p)
    for (std::size_t axis = 0; axis < 3; ++axis) {
      if (!(std::abs(position(grid, p)[axis] - position(grid, joined[p])[axis]) > most)) continue;
      throw Error{Status::bad_input,
                  grid.is_triangle_soup
                      ? file + ", triangle " + std::to_string(p / 3) +
                            ": a corner has separated from the corners that it coincides with in " + first +
                            "; the triangles are not those of the same mesh"
                      : file + ": points " + std::to_string(joined[p]) + " and " + std::to_string(p) +
                            " of its pieces are the same node in " + first +
                            ", but here they are at different places; export node ids of the whole mesh (NODE_ID or "
                            "GlobalNodeId)"};
    }
}
}  // namespace lbea::io::grid
