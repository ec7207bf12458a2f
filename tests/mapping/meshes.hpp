// Meshes of one surface with other elements, numbers and shapes.
#pragma once

#include "tests/support/synthetic_simulation.hpp"

#include <algorithm>
#include <map>
#include <numbers>

namespace lbea::test {

constexpr std::uint32_t renumbering = 40'000;
constexpr PlateShape coarse{20, 10, 190, 90};  // elements of 10 x 10

/// The same elements, nodes and elements in reverse order, with other ids.
inline SimulationMesh renumbered(const SimulationMesh& mesh) {
  SimulationMesh other = mesh;
  const auto last = static_cast<std::uint32_t>(mesh.nodes() - 1);
  for (std::uint32_t node = 0; node <= last; ++node) {
    std::copy_n(&mesh.positions[3 * std::size_t{last - node}], 3, &other.positions[3 * std::size_t{node}]);
    other.node_ids[node] = mesh.node_ids[last - node] + renumbering;
  }
  for (Quad& element : other.elements)
    for (std::uint32_t& node : element) node = last - node;
  for (std::uint32_t& id : other.element_ids) id += renumbering;
  std::ranges::reverse(other.elements);
  std::ranges::reverse(other.element_ids);
  std::ranges::reverse(other.element_parts);
  return other;
}

/// A tube of square section, 400 x 60 x 60, bowed along y by up to `bow` in its middle. along, across: elements.
inline SimulationMesh tube_mesh(std::uint32_t along, std::uint32_t across, double bow) {
  constexpr double length = 400, side = 60;
  SimulationMesh mesh;
  const std::uint32_t around = 4 * across;
  for (std::uint32_t i = 0; i <= along; ++i)
    for (std::uint32_t j = 0; j < around; ++j) {
      const double x = length * i / along, at = side * (j % across) / across;
      const std::array<std::array<double, 2>, 4> section{{{at, 0}, {side, at}, {side - at, side}, {0, side - at}}};
      const auto& [y, z] = section[j / across];
      mesh.positions.insert(
          mesh.positions.end(),
          {static_cast<float>(x), static_cast<float>(y + bow * std::sin(std::numbers::pi * x / length)),
           static_cast<float>(z)});
      mesh.node_ids.push_back(i * around + j + 1);
    }
  for (std::uint32_t i = 0; i < along; ++i)
    for (std::uint32_t j = 0; j < around; ++j) {
      const std::uint32_t node = i * around + j, beside = i * around + (j + 1) % around;
      mesh.elements.push_back({node, beside, beside + around, node + around});
      mesh.element_ids.push_back(i * around + j + 1);
      mesh.element_parts.push_back(1);
    }
  return mesh;
}

/// Two plates, the second one at z = 2, of these parts.
inline SimulationMesh two_plates(const PlateShape& shape, const std::array<std::uint32_t, 2>& parts) {
  SimulationMesh mesh = plate_mesh(shape);
  const std::size_t nodes = mesh.nodes(), elements = mesh.elements.size();
  for (std::size_t i = 0; i < nodes; ++i) {
    mesh.positions.insert(mesh.positions.end(), {mesh.positions[3 * i], mesh.positions[3 * i + 1], 2});
    mesh.node_ids.push_back(mesh.node_ids[i] + 10'000);
  }
  for (std::size_t e = 0; e < elements; ++e) {
    Quad element = mesh.elements[e];
    for (std::uint32_t& node : element) node += static_cast<std::uint32_t>(nodes);
    mesh.elements.push_back(element);
    mesh.element_ids.push_back(mesh.element_ids[e] + 10'000);
  }
  mesh.element_parts.assign(elements, parts[0]);
  mesh.element_parts.resize(2 * elements, parts[1]);
  return mesh;
}

/// x and y at shares (from 0) of an element of a plate.
inline std::array<double, 2> place_on(const SimulationMesh& mesh, const Quad& q, double along, double across) {
  std::array<double, 2> place{};
  for (std::size_t axis = 0; axis < 2; ++axis) {
    const auto corner = [&](std::size_t i) { return double{mesh.positions[3 * std::size_t{q[i]} + axis]}; };
    place[axis] = std::lerp(std::lerp(corner(0), corner(1), along), std::lerp(corner(3), corner(2), along), across);
  }
  return place;
}

/// A plate without the elements whose middle is at such x and y.
template <class Predicate>
SimulationMesh without(const SimulationMesh& mesh, const Predicate& is_removed) {
  SimulationMesh rest = mesh;
  rest.elements.clear();
  rest.element_ids.clear();
  rest.element_parts.clear();
  for (std::size_t e = 0; e < mesh.elements.size(); ++e) {
    const auto [x, y] = place_on(mesh, mesh.elements[e], 0.5, 0.5);
    if (is_removed(x, y)) continue;
    rest.elements.push_back(mesh.elements[e]);
    rest.element_ids.push_back(mesh.element_ids[e]);
    rest.element_parts.push_back(mesh.element_parts[e]);
  }
  return rest;
}

inline double largest_difference(const std::vector<float>& a, const std::vector<float>& b) {
  double largest = a.size() == b.size() ? 0 : INFINITY;
  for (std::size_t i = 0; i + 2 < std::min(a.size(), b.size()); i += 3)
    largest = std::max(largest, std::hypot(double{a[i]} - double{b[i]}, double{a[i + 1]} - double{b[i + 1]},
                                           double{a[i + 2]} - double{b[i + 2]}));
  return largest;
}

}  // namespace lbea::test
