// Memory and time of a bake in shards: per run no more for an ensemble ten times as large; a million vertices.
#include "precompute/model_file/estimate.hpp"
#include "tests/precompute/jobs/shard_plates.hpp"
#include "tests/support/instrumented.hpp"

#include <cmath>

using namespace lbea;
using namespace lbea::bake;
using namespace lbea::test;

// What stays in memory per run is its name, steps, times and keys: less than 2 kB. The branches are grouped from at
// most 256 runs: 256 rows of 6 kB, and twice 256 x 256 distances, 2.6 MB. The merge trains a regression with at most
// 2,048 images: a few matrices of their features and of their kernels; and predicts at most 1,500 frames of whole
// tests.
TEST_CASE("memory, and time per run, of a shard and of the merge do not grow with the ensemble" *
          doctest::skip(is_instrumented)) {
  const std::uint32_t few = is_long_run() ? 100 : 20, many = 10 * few;
  const PlateShape shape{40, 25, 390, 240};
  struct Cost {
    Usage shard, merge;
    std::uintmax_t model_kb = 0;
    long training_kb = 0;
    double training_s = 0;
  };
  const auto cost = [&](std::uint32_t runs) {
    const TemporaryFolder folder;
    const WorkFolder work(folder / "work", false);
    const CountedPlates plates = counted_plates(runs, 2, shape);
    const auto opener = [&](const std::string& source) { return plates.ensemble.runs.at(std::stoul(source)).open(); };
    Ensemble ensemble = plates.ensemble;
    for (std::uint32_t run = 0; run < runs; ++run) ensemble.runs[run].source = std::to_string(run);
    in_a_process({},
                 [&](const BakeOptions& options) { (void)plan_bake(work, ensemble, shard_description(), options); });
    Cost result;
    result.shard =
        in_a_process({}, [&](const BakeOptions& options) { bake_shard(work, read_plan(work, opener), {}, options); });
    result.merge = in_a_process({}, [&](const BakeOptions& options) {
      merge_shards(work, read_plan(work, opener), folder / "m.lbea", options);
    });
    const BakePlan plan = read_plan(work, opener);
    const auto images = static_cast<long>(ShapeRegression::trained_with(plan.survey.samples()));
    const auto features = static_cast<long>(ShapeRegression::features(*plan.camera));
    const long frames = std::min(10L * runs, 1'000L) + std::min(10L * runs, 500L);
    result.training_kb = 8 * (images * (3 * features + 6 * images) + frames * (features + 2 * images)) / 1024;
    result.training_s = 25e-9 * std::pow(static_cast<double>(images), 3);  // at a billion operations a second
    result.model_kb = std::filesystem::file_size(folder / "m.lbea") / 1024;
    MESSAGE(runs << " runs: shard " << result.shard.peak_kb << " kB, " << 1e3 * result.shard.cpu_s / runs
                 << " ms a run; merge " << result.merge.peak_kb << " kB, " << 1e3 * result.merge.cpu_s / runs
                 << " ms a run, of which " << result.training_kb << " kB to train; model " << result.model_kb << " kB");
    return result;
  };
  const Cost small = cost(few), large = cost(many);
  const long allowed = 2L * (many - few) + 2'600;
  CHECK(large.model_kb - small.model_kb > static_cast<std::uintmax_t>(2 * allowed));
  CHECK(large.shard.peak_kb - small.shard.peak_kb < allowed);
  CHECK(large.merge.peak_kb - small.merge.peak_kb < allowed + large.training_kb);
  CHECK(large.shard.cpu_s / many < 2 * small.shard.cpu_s / few);
  CHECK(large.merge.cpu_s / many < 2 * small.merge.cpu_s / few + large.training_s / many);
}

// What BENCHMARK.md extrapolates from. The estimate that plan prints is held against it.
TEST_CASE("a state of a hundred thousand nodes: shard and merge, and the estimate of them" *
          doctest::skip(is_instrumented)) {
  if (!is_long_run()) return;
  constexpr std::uint32_t runs = 2, steps = 20;
  const TemporaryFolder folder;
  const WorkFolder work(folder / "work", false);
  const CountedPlates plates = counted_plates(runs, steps, {350, 286, 3490, 2850});
  EnsembleDescription description = shard_description();
  description.modes = 100;
  BakeOptions options = shard_options();
  options.depth_renderer = {};
  const BakePlan plan = plan_bake(work, plates.ensemble, description, options);
  const auto without_views = [](BakeOptions all) {
    all.depth_renderer = {};
    return all;
  };
  const BakeEstimate expected = estimate(work, plan, options);
  const Usage shard = in_a_process({}, [&](const BakeOptions& all) { bake_shard(work, plan, {}, without_views(all)); });
  const Usage merge = in_a_process(
      {}, [&](const BakeOptions& all) { merge_shards(work, plan, folder / "m.lbea", without_views(all)); });
  const double states = runs * steps;
  MESSAGE(plates.ensemble.runs.size()
          << " x " << steps << " states: shard " << 1e3 * shard.cpu_s / states << " ms a state, "
          << shard.peak_kb / 1000 << " MB; merge " << 1e3 * merge.cpu_s / states << " ms, " << merge.peak_kb / 1000
          << " MB; record "
          << static_cast<double>(std::filesystem::file_size(work.file(plan.runs[1].record_name()))) / 1e6 / steps
          << " MB a state; expected " << 1e3 * expected.seconds_per_sample << " ms");
  CHECK(expected.model_bytes == std::filesystem::file_size(folder / "m.lbea"));
  CHECK(expected.seconds_per_sample * states > shard.cpu_s / 2);
  CHECK(expected.seconds_per_sample * states < shard.cpu_s * 2);
}

TEST_CASE("a million vertices and a hundred modes in less than 16 GiB" * doctest::skip(is_instrumented)) {
  if (!is_long_run()) return;
  const TemporaryFolder folder;
  EnsembleDescription description = shard_description();
  description.modes = 100;
  const CountedPlates plates = counted_plates(1, 2, {1200, 834, 1000, 700});
  const Usage usage = in_a_process({}, [&](BakeOptions options) {
    options.depth_renderer = {};
    bake_model(plates.ensemble, description, folder / "m.lbea", options);
  });
  const Model model = Model::open(folder / "m.lbea");
  CHECK(model.vertices() == 1200 * 834);
  const std::string provenance(model.provenance());
  const std::string key = "\"largest_residual\":";
  const double residual = std::stod(provenance.substr(provenance.find(key) + key.size()));
  MESSAGE("peak " << usage.peak_kb / 1024 << " MiB, " << usage.cpu_s << " s, largest residual " << residual);
  CHECK(usage.peak_kb < 16L * 1024 * 1024);
  CHECK(residual < 1e-9);  // relative to the largest eigenvalue
}
