// kernel_calls KERNEL TIMES: calls an inner loop, for count_instructions.sh. Without arguments prints the names.
#include "runtime/src/kernels/kernels.hpp"

#include <array>
#include <cstdio>
#include <cstdlib>
#include <string_view>
#include <vector>

using namespace lbea;

namespace {
constexpr std::size_t count = 4096;  // points, cells or coefficients

/// A wavy surface of 4,096 points in 256 leaves, and queries near it.
struct Scene {
  std::vector<Leaf> leaves{count / 16};
  std::vector<BoxGroup> boxes{count / 256}, top{1};
  CloudTree tree{};
  std::array<float, 16> x{}, y{}, z{};
  const float* queries[3] = {x.data(), y.data(), z.data()};

  explicit Scene(const Kernels& kernels) {
    auto* const placed = reinterpret_cast<PlacedPoint*>(leaves.data());
    for (std::uint32_t i = 0; i < count; ++i) {
      const std::uint32_t leaf = i / 16, column = 4 * (leaf % 16) + i % 4, row = 4 * (leaf / 16) + i / 4 % 4;
      placed[i] = {static_cast<float>(column), static_cast<float>(row), static_cast<float>(i % 7) / 8, i};
    }
    kernels.fill_leaves(count, leaves.data(), boxes.data());
    kernels.enclose(boxes.data(), leaves.size(), top.data());
    tree.leaves = leaves.data();
    tree.groups[0] = boxes.data();
    tree.groups[1] = top.data();
    tree.top = 1;
    for (std::size_t i = 0; i < 16; ++i) {
      x[i] = 30.3f + static_cast<float>(i % 4);
      y[i] = 30.2f + static_cast<float>(i / 4);
    }
  }
};

constexpr std::array names{"nearest",    "nearest_16",     "project",        "mode_distance",
                           "add_depths", "compare_depths", "subtract_depths"};

void call(const Kernels& kernels, std::string_view name, std::size_t times) {
  const Scene scene(kernels);
  const std::vector<float> ones(count, 1), twos(count, 2);
  const std::vector<std::uint16_t> image(count, 3);
  std::vector<float> out(count);
  std::vector<CellTally> tallies(count + 1);
  constexpr float T[12] = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 50};
  constexpr CellRaster raster{50, 32, 32, 0, 10, 64, 64};
  constexpr CellPrices prices{5, 2};
  for (std::size_t i = 0; i < times; ++i) {
    if (name == "nearest") out[0] = kernels.nearest(scene.tree, T, {}).squared;
    if (name == "nearest_16") {
      NearestPoints best{};
      std::array<std::uint32_t, 16> no_hints;
      no_hints.fill(NearestPoint::none);
      for (std::size_t q = 0; q < 16; ++q) best.squared[q] = 1e30f, best.point[q] = NearestPoint::none;
      kernels.nearest_16(scene.tree, scene.queries, no_hints.data(), best);
    }
    if (name == "project") kernels.project(ones.data(), 1, count, twos.data(), out.data());
    const float* const coefficients[3] = {ones.data(), ones.data(), ones.data()};
    if (name == "mode_distance") out[0] = kernels.mode_distance(coefficients, twos.data(), 1280, 1e30f);
    if (name == "add_depths") kernels.add_depths(scene.leaves.data(), 256, T, raster, tallies.data());
    if (name == "compare_depths") out[0] = kernels.compare_depths(twos.data(), image.data(), count, prices).squares;
    if (name == "subtract_depths") kernels.subtract_depths(twos.data(), image.data(), count, prices, out.data());
  }
}
}  // namespace

int main(int argc, char** argv) {
  if (argc != 3)
    for (const char* name : names) std::printf("%s\n", name);
  else
    call(kernels(), argv[1], static_cast<std::size_t>(std::atoi(argv[2])));
}
