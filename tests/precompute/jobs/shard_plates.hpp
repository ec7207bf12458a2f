// Bending plates for bakes in shards: runs that count how often they are read, a renderer that evaluates a formula, and
// processes that are killed.
#pragma once

#include "precompute/jobs/jobs.hpp"
#include "tests/support/files.hpp"
#include "tests/support/synthetic_model.hpp"

#include <doctest/doctest.h>

#include <atomic>
#include <cmath>
#include <csignal>
#include <cstdlib>
#include <functional>
#include <memory>

#include <sys/resource.h>
#include <sys/time.h>
#include <sys/wait.h>
#include <unistd.h>

namespace lbea::test {

using namespace lbea::bake;

inline bool is_long_run() { return std::getenv("LBEA_LONG_TESTS") != nullptr; }

/// A plate whose states are computed when they are read: any number of runs takes no memory.
class FormulaPlate : public SimulationReader {
 public:
  FormulaPlate(double final_angle, std::uint32_t steps, const PlateShape& shape,
               std::shared_ptr<std::atomic<int>> reads)
      : shape_(shape), mesh_(plate_mesh(shape)), final_angle_(final_angle), steps_(steps), reads_(std::move(reads)) {}

  const SimulationMesh& mesh() const noexcept override { return mesh_; }
  const std::vector<SimulationField>& fields() const noexcept override { return fields_; }
  std::uint32_t states() const noexcept override { return steps_; }
  double time_s(std::uint32_t state) const override { return 0.0005 * state; }
  void read(std::uint32_t state, SimulationState& into) override {
    ++*reads_;
    into = bent_state(mesh_, time_s(state), final_angle_ * (state + 1) / steps_, static_cast<double>(shape_.length));
  }
  std::vector<std::filesystem::path> files() const override { return {}; }

 private:
  PlateShape shape_;
  SimulationMesh mesh_;
  double final_angle_;
  std::uint32_t steps_;
  std::shared_ptr<std::atomic<int>> reads_;
  std::vector<SimulationField> fields_{{"plastic_strain", "1"}};
};

struct CountedPlates {
  Ensemble ensemble;
  std::vector<std::shared_ptr<std::atomic<int>>> reads;  // per run: states read
};

inline CountedPlates counted_plates(std::uint32_t runs, std::uint32_t steps = 3,
                                    const PlateShape& shape = {8, 5, 70, 40}) {
  CountedPlates plates;
  plates.ensemble.parameter_names = {"final_angle [rad]"};
  for (std::uint32_t run = 0; run < runs; ++run) {
    auto& reads = plates.reads.emplace_back(std::make_shared<std::atomic<int>>(0));
    const double angle = 0.5 + 0.9 * std::sin(run);
    plates.ensemble.runs.push_back({"plate_" + std::to_string(run), {angle}, [=] {
                                      return std::make_unique<FormulaPlate>(angle, steps, shape, reads);
                                    }});
  }
  return plates;
}

inline EnsembleDescription shard_description(ReferenceMode mode = ReferenceMode::impact) {
  EnsembleDescription description;
  description.mode = mode;
  description.modes = 6;
  return description;
}

/// Images that change with every position.
class FormulaRenderer : public DepthRenderer {
 public:
  FormulaRenderer(const std::array<float, 3>& low, const std::array<float, 3>& high) {
    camera_.focal = 10;
    camera_.depth_origin = low[2] - 1;
    camera_.depth_step = (high[2] - low[2] + 2) / 60'000;
    camera_.columns = 8;
    camera_.rows = 5;
  }
  const DepthCamera& camera() const noexcept override { return camera_; }
  void render(std::span<const float> positions, std::span<const std::uint8_t>,
              std::span<std::uint16_t> image) const override {
    std::ranges::fill(image, empty_cell);
    for (std::size_t cell = 0; cell < camera_.cells(); ++cell) {
      const float z = positions[3 * (cell * 7 % (positions.size() / 3)) + 2];
      image[cell] = static_cast<std::uint16_t>(1 + (z - camera_.depth_origin) / camera_.depth_step);
    }
  }

 private:
  DepthCamera camera_;
};

inline BakeOptions shard_options(unsigned threads = 1) {
  BakeOptions options;
  options.threads = threads;
  options.leaves_out_broken = true;
  options.depth_renderer = [](const CommonMesh&, const std::array<float, 3>& low, const std::array<float, 3>& high) {
    return std::make_unique<FormulaRenderer>(low, high);
  };
  return options;
}

/// The model of a single process.
inline std::string baked_alone(const Ensemble& ensemble, const EnsembleDescription& description) {
  const TemporaryFolder folder;
  bake_model(ensemble, description, folder / "m.lbea", shard_options(1));
  return text_of(folder / "m.lbea");
}

inline std::string merged(const WorkFolder& work, const BakePlan& plan) {
  const TemporaryFolder folder;
  merge_shards(work, plan, folder / "m.lbea", shard_options(2));
  return text_of(folder / "m.lbea");
}

/// When a process is killed: at its n-th step, before it begins a run or reads a state, or after some microseconds.
/// 0: it is not killed.
struct Death {
  int at_step = 0;
  long after_us = 0;
};

struct Usage {
  long peak_kb = 0;
  double cpu_s = 0;
};

/// Runs `body` in a separate process; returns its memory and time, 0 when it was killed.
inline Usage in_a_process(const Death& death, const std::function<void(BakeOptions)>& body, unsigned threads = 1) {
  const pid_t child = ::fork();
  if (child == 0) {
    BakeOptions options = shard_options(threads);
    auto steps = std::make_shared<std::atomic<int>>(0);
    if (death.at_step > 0)
      options.cancelled = [=] {
        if (++*steps == death.at_step) ::raise(SIGKILL);
        return false;
      };
    const itimerval timer{{0, 0}, {0, death.after_us}};
    std::signal(SIGALRM, SIG_DFL);
    if (death.after_us > 0) ::setitimer(ITIMER_REAL, &timer, nullptr);
    try {
      body(options);
    } catch (const std::exception&) { ::_exit(1); }
    ::_exit(0);
  }
  int status = 0;
  rusage usage{};
  REQUIRE(::wait4(child, &status, 0, &usage) == child);
  const bool failed = WIFEXITED(status) && WEXITSTATUS(status) != 0;
  CHECK_FALSE(failed);
  if (!WIFEXITED(status) || failed) return {};
  const auto seconds = [](const timeval& time) {
    return static_cast<double>(time.tv_sec) + 1e-6 * static_cast<double>(time.tv_usec);
  };
  return {usage.ru_maxrss, seconds(usage.ru_utime) + seconds(usage.ru_stime)};
}

}  // namespace lbea::test
