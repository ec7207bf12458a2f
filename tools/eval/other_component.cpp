#include "tools/eval/other_component.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

namespace lbea::tool {
namespace {

using Vec = std::array<double, 3>;

constexpr std::uint32_t along = 60, around = 48;  // nodes
constexpr double final_length = 0.6;

struct Frame3 {
  Vec low, size;
  std::size_t axis = 0;  // of the longest side
};

Frame3 box_of(std::span<const float> positions) {
  constexpr double infinity = std::numeric_limits<double>::infinity();
  Frame3 box{{infinity, infinity, infinity}, {-infinity, -infinity, -infinity}};
  for (std::size_t i = 0; i < positions.size(); ++i) {
    box.low[i % 3] = std::min(box.low[i % 3], double{positions[i]});
    box.size[i % 3] = std::max(box.size[i % 3], double{positions[i]});
  }
  for (std::size_t i = 0; i < 3; ++i) {
    box.size[i] -= box.low[i];
    if (box.size[i] > box.size[box.axis]) box.axis = i;
  }
  return box;
}

/// In the unit cube: u along, v around.
using Shape = Vec (*)(double u, double v);

Vec tube(double u, double v) {
  return {u, 0.5 + 0.5 * std::cos(2 * std::numbers::pi * v), 0.5 + 0.5 * std::sin(2 * std::numbers::pi * v)};
}
Vec narrow_box(double u, double v) {
  const double side = std::floor(4 * v), at = 4 * v - side;
  const std::array<std::array<double, 2>, 5> corners{{{0.3, 0}, {0.7, 0}, {0.7, 1}, {0.3, 1}, {0.3, 0}}};
  const auto& a = corners[static_cast<std::size_t>(side) % 4];
  const auto& b = corners[static_cast<std::size_t>(side) % 4 + 1];
  return {u, std::lerp(a[0], b[0], at), std::lerp(a[1], b[1], at)};
}
Vec corrugated_plate(double u, double v) { return {u, v, 0.5 + 0.3 * std::sin(6 * std::numbers::pi * v)}; }
Vec ball(double u, double v) {
  const double polar = std::numbers::pi * u, r = 0.5 * std::sin(polar);
  return {0.5 - 0.5 * std::cos(polar), 0.5 + r * std::cos(2 * std::numbers::pi * v),
          0.5 + r * std::sin(2 * std::numbers::pi * v)};
}

class ShapeRun final : public bake::SimulationReader {
 public:
  ShapeRun(Shape shape, const Frame3& box, std::vector<double> times)
      : shape_(shape), box_(box), times_(std::move(times)) {
    mesh_.positions = at(1);
    for (std::uint32_t i = 0; i < along * around; ++i) mesh_.node_ids.push_back(i + 1);
    for (std::uint32_t j = 0; j + 1 < along; ++j)
      for (std::uint32_t i = 0; i + 1 < around; ++i) {
        const std::uint32_t node = j * around + i;
        mesh_.elements.push_back({node, node + 1, node + 1 + around, node + around});
        mesh_.element_ids.push_back(static_cast<std::uint32_t>(mesh_.elements.size()));
        mesh_.element_parts.push_back(1);
      }
  }
  const bake::SimulationMesh& mesh() const noexcept override { return mesh_; }
  const std::vector<bake::SimulationField>& fields() const noexcept override { return fields_; }
  std::uint32_t states() const noexcept override { return static_cast<std::uint32_t>(times_.size()); }
  double time_s(std::uint32_t state) const override { return times_.at(state); }
  void read(std::uint32_t state, bake::SimulationState& into) override {
    into.time_s = times_.at(state);
    into.positions =
        at(std::lerp(1.0, final_length,
                     static_cast<double>(state) / static_cast<double>(std::max<std::size_t>(times_.size() - 1, 1))));
    into.alive.assign(mesh_.elements.size(), 1);
    into.fields.clear();
  }
  std::vector<std::filesystem::path> files() const override { return {}; }

 private:
  [[nodiscard]] std::vector<float> at(double length) const {
    std::vector<float> positions;
    for (std::uint32_t j = 0; j < along; ++j)
      for (std::uint32_t i = 0; i < around; ++i) {
        const Vec unit = shape_(static_cast<double>(j) / (along - 1), static_cast<double>(i) / (around - 1));
        Vec p{};
        for (std::size_t k = 0; k < 3; ++k) {
          const std::size_t axis = (box_.axis + k) % 3;
          p[axis] = box_.low[axis] + box_.size[axis] * unit[k] * (k == 0 ? length : 1);
        }
        for (const double value : p) positions.push_back(static_cast<float>(value));
      }
    return positions;
  }

  Shape shape_;
  Frame3 box_;
  std::vector<double> times_;
  bake::SimulationMesh mesh_;
  std::vector<bake::SimulationField> fields_;
};

/// Times of the simulation with the most samples.
std::vector<double> times_of(const Model& model) {
  std::vector<std::vector<double>> times(model.simulations());
  for (std::uint32_t s = 0; s < model.samples(); ++s)
    times[model.sample(s).simulation].push_back(model.sample_time_s(s));
  return *std::ranges::max_element(times, {}, &std::vector<double>::size);
}

}  // namespace

std::vector<Experiment> other_components(const Model& model) {
  const Frame3 box = box_of(model.node_positions(0));
  const auto times = times_of(model);
  std::vector<Experiment> experiments;
  for (const auto& [name, shape] : std::initializer_list<std::pair<const char*, Shape>>{
           {"tube", tube}, {"narrow box", narrow_box}, {"corrugated plate", corrugated_plate}, {"ball", ball}})
    experiments.push_back(
        {name, [shape = shape, box, times] { return std::make_unique<ShapeRun>(shape, box, times); }});
  return experiments;
}

}  // namespace lbea::tool
