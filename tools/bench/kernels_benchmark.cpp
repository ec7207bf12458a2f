// Benchmarks the inner loops of the matcher for every instruction set that this processor supports, on generated data
// of the usual size: a sheet of 2,000 vertices, 100 modes, 2,806 samples, and two clouds of slightly different sheets
// in turn.
#include "runtime/src/kernels/kernels.hpp"
#include "runtime/src/match/cloud_index.hpp"
#include "runtime/src/match/correspondence.hpp"
#include "runtime/src/match/sample_search.hpp"

#include <benchmark/benchmark.h>

#include <cmath>
#include <random>

namespace {

using namespace lbea;

constexpr std::size_t vertices = 2'000, modes = 100, samples = 2'806;
constexpr std::uint32_t grid_cells = 20'000;

std::array<float, 3> on_sheet(float along, float across, float depth) {
  return {400 * along, 60 * across, depth * std::sin(20 * along) * std::cos(3 * across)};
}

std::vector<std::array<float, 3>> mesh() {
  constexpr std::size_t columns = 100;
  std::vector<std::array<float, 3>> positions;
  for (std::size_t v = 0; v < vertices; ++v)
    positions.push_back(on_sheet(static_cast<float>(v % columns) / columns,
                                 static_cast<float>(v / columns) / (vertices / columns), 10));
  return positions;
}

// Depths of the sheets of two consecutive frames.
constexpr float depth = 12, next_depth = 12.5f;

std::vector<Point> cloud(std::size_t count, float sheet_depth) {
  std::mt19937 random(1);
  std::uniform_real_distribution<float> unit(0, 1);
  std::vector<Point> points;
  for (std::size_t i = 0; i < count; ++i) {
    const auto [x, y, z] = on_sheet(unit(random), unit(random), sheet_depth);
    points.push_back({x, y, z});
  }
  return points;
}

std::vector<float> numbers(std::size_t count, unsigned seed) {
  std::mt19937 random(seed);
  std::normal_distribution<float> value(0, 50);
  std::vector<float> result(count);
  for (float& number : result) number = value(random);
  return result;
}

CloudIndex index_for(std::size_t points, const Kernels& code) {
  const std::vector<std::array<float, 3>> corners{{0, 0, -next_depth}, {400, 60, next_depth}};
  return {bounding_grid(corners, grid_cells), static_cast<std::uint32_t>(points), code};
}

void index_build(benchmark::State& state, const Kernels& code) {
  const auto points = static_cast<std::size_t>(state.range(0));
  const std::vector<Point> frames[2] = {cloud(points, depth), cloud(points, next_depth)};
  CloudIndex index = index_for(points, code);
  std::size_t turn = 0;
  for (auto _ : state) benchmark::DoNotOptimize(index.build(frames[turn++ % 2], identity_transform));
}

// Every search starts from the nearest points of the other cloud.
void nearest_points(benchmark::State& state, const Kernels& code) {
  const auto points = static_cast<std::size_t>(state.range(0));
  CloudIndex indexes[2] = {index_for(points, code), index_for(points, code)};
  indexes[0].build(cloud(points, depth), identity_transform);
  indexes[1].build(cloud(points, next_depth), identity_transform);
  const std::vector<std::array<float, 3>> queries = mesh();
  Positions corresponding(queries.size());
  std::size_t turn = 0;
  for (auto _ : state) {
    correspond(indexes[turn++ % 2], queries, corresponding);
    benchmark::DoNotOptimize(corresponding.planes[0].data());
  }
}

void projection(benchmark::State& state, const Kernels& code) {
  const std::size_t stride = format::padded(vertices);
  const std::vector<float> rows = numbers(modes * stride, 2), f = numbers(stride, 3);
  std::vector<float> coefficients(modes);
  for (auto _ : state)
    for (std::size_t axis = 0; axis < 3; ++axis) {
      code.project(rows.data(), modes, stride, f.data(), coefficients.data());
      benchmark::DoNotOptimize(coefficients.data());
    }
}

void search(benchmark::State& state, const Kernels& code) {
  const std::size_t stride = format::padded(modes);
  const std::vector<float> table = numbers(samples * 3 * stride, 4), frame = numbers(3 * stride, 5);
  const float* const e[3] = {frame.data(), frame.data() + stride, frame.data() + 2 * stride};
  BestSamples best(5);
  for (auto _ : state) {
    best.clear();
    for (std::uint32_t s = 0; s < samples; ++s)
      best.offer(s, code.mode_distance(e, table.data() + 3 * stride * s, stride, best.bound()));
    benchmark::DoNotOptimize(best.ranked().data());
  }
}

}  // namespace

int main(int argc, char** argv) {
  for (const Kernels* const* code = available_kernels(); *code != nullptr; ++code) {
    const std::string name = std::string("/") + (*code)->name;
    const auto add = [&](const char* stage, void (*run)(benchmark::State&, const Kernels&)) {
      return benchmark::RegisterBenchmark((stage + name).c_str(),
                                          [run, code](benchmark::State& state) { run(state, **code); })
          ->Unit(benchmark::kMicrosecond);
    };
    add("index_build", index_build)->Arg(16'000)->Arg(62'000);
    add("nearest_points", nearest_points)->Arg(16'000)->Arg(62'000);
    add("projection", projection);
    add("search", search);
  }
  benchmark::Initialize(&argc, argv);
  if (benchmark::ReportUnrecognizedArguments(argc, argv)) return 2;
  benchmark::RunSpecifiedBenchmarks();
  return 0;
}
