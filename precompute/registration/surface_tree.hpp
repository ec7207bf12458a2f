// The nearest place on a surface mesh: triangles in a tree of boxes.
#pragma once

#include <array>
#include <cstdint>
#include <limits>
#include <span>
#include <vector>

namespace lbea::bake {
struct SurfacePlace {
  std::uint32_t element = std::numeric_limits<std::uint32_t>::max();  // none within reach: this
  std::array<std::uint32_t, 3> nodes{};                               // the triangle's corners
  std::array<double, 3> shares{};  // barycentric: position = sum of shares times corners
  std::array<double, 3> position{};
  std::array<double, 3> normal{};  // of the triangle, length 1
  double distance = std::numeric_limits<double>::infinity();

  [[nodiscard]] bool found() const noexcept { return element != std::numeric_limits<std::uint32_t>::max(); }
};

/// Selects triangles whose normal, in either direction, is within an angle of one of these. No normals: all triangles.
struct Facing {
  std::span<const std::array<double, 3>> normals{};
  double least_cosine = 0;
};

class SurfaceTree {
 public:
  /// positions: nodes x 3; elements: node indices, a triangle repeats its last node; quads are split along nodes 0-2.
  /// kept: one per element, 0 = left out; empty: all. Triangles without area or with a position that is not finite are
  /// left out. Throws Error{bad_input} for an index that is not a node.
  SurfaceTree(std::span<const float> positions, std::span<const std::array<std::uint32_t, 4>> elements,
              std::span<const std::uint8_t> kept = {});

  /// Exact; ties to the triangle that comes first in the tree.
  [[nodiscard]] SurfacePlace nearest(const std::array<double, 3>& point,
                                     double reach = std::numeric_limits<double>::infinity(),
                                     const Facing& facing = {}) const;
  [[nodiscard]] std::size_t triangles() const noexcept { return triangles_.size(); }

 private:
  struct Triangle {
    std::array<std::array<double, 3>, 3> corners;
    std::array<double, 3> normal;
    std::array<std::uint32_t, 3> nodes;
    std::uint32_t element;
  };
  struct Branch {
    std::array<double, 3> low, high;
    std::array<double, 3> normal_low, normal_high;  // box of the triangles' normals
    std::uint32_t first, count, right;              // right 0: a leaf; the left child follows its parent
  };
  void build(std::uint32_t first, std::uint32_t count);

  std::vector<Triangle> triangles_;
  std::vector<Branch> branches_;
};
}  // namespace lbea::bake
