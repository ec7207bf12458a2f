// Models larger than memory: what matching needs stays in RAM, the rest is read from the file on demand.
#include "runtime/src/model/model_view.hpp"
#include "tests/precompute/jobs/shard_plates.hpp"
#include "tests/support/instrumented.hpp"

#include <cstdint>
#include <cstdio>
#include <fstream>
#include <string>

#include <fcntl.h>
#include <sys/mman.h>

using namespace lbea;
using namespace lbea::bake;
using namespace lbea::test;

namespace {

struct LargeModel {
  std::uint32_t runs = 0, steps = 0;
  PlateShape shape;
};

void bake_large(const std::filesystem::path& file, const LargeModel& large, std::optional<bool> landmarks) {
  EnsembleDescription description = shard_description();
  description.landmarks = landmarks;
  description.correspondence = false;
  bake_model(counted_plates(large.runs, large.steps, large.shape).ensemble, description, file, shard_options(0));
}

/// A sample as the sensor would see it, from the formula and not from the model.
std::vector<Point> frame_of(const LargeModel& large, std::uint32_t run, std::uint32_t step) {
  SimulationState state;
  counted_plates(run + 1, large.steps, large.shape).ensemble.runs[run].open()->read(step, state);
  std::vector<Point> points;
  for (std::size_t i = 0; i < state.positions.size(); i += 3)
    points.push_back({state.positions[i], state.positions[i + 1], state.positions[i + 2]});
  return points;
}

void forget_file(const std::filesystem::path& file) {
  const int descriptor = ::open(file.c_str(), O_RDONLY | O_CLOEXEC);
  ::fsync(descriptor);
  ::posix_fadvise(descriptor, 0, 0, POSIX_FADV_DONTNEED);
  ::close(descriptor);
}

/// Share of the pages wholly inside `bytes` that the machine holds.
double share_in_memory(std::span<const std::byte> bytes) {
  constexpr std::uintptr_t page = 4096;
  const auto begin = (reinterpret_cast<std::uintptr_t>(bytes.data()) + page - 1) / page,
             end = (reinterpret_cast<std::uintptr_t>(bytes.data()) + bytes.size()) / page;
  if (end <= begin) return 0;
  std::vector<unsigned char> pages(end - begin);
  REQUIRE(
      ::mincore(const_cast<std::byte*>(bytes.data()) + (begin * page - reinterpret_cast<std::uintptr_t>(bytes.data())),
                pages.size() * page, pages.data()) == 0);
  return static_cast<double>(std::ranges::count_if(pages, [](unsigned char p) { return (p & 1) != 0; })) /
         static_cast<double>(pages.size());
}

/// False for file systems in memory.
bool is_forgotten(const std::filesystem::path& file) {
  const int descriptor = ::open(file.c_str(), O_RDONLY | O_CLOEXEC);
  const auto size = static_cast<std::size_t>(std::filesystem::file_size(file));
  void* const address = ::mmap(nullptr, size, PROT_READ, MAP_SHARED, descriptor, 0);
  ::close(descriptor);
  REQUIRE(address != MAP_FAILED);
  const double share = share_in_memory({static_cast<const std::byte*>(address), size});
  ::munmap(address, size);
  return share < 0.05;
}

/// kB of a line of /proc/self/status.
long status_kb(const std::string& name) {
  std::ifstream in("/proc/self/status");
  for (std::string line; std::getline(in, line);)
    if (line.starts_with(name + ":")) return std::stol(line.substr(name.size() + 1));
  return 0;
}

long major_faults() {
  rusage usage{};
  ::getrusage(RUSAGE_SELF, &usage);
  return usage.ru_majflt;
}

}  // namespace

TEST_CASE("landmarks give the same matches, and the same coverage where they are all the vertices") {
  for (const PlateShape shape : {PlateShape{8, 5, 70, 40}, PlateShape{70, 30, 700, 300}}) {
    const LargeModel large{3, 4, shape};
    const TemporaryFolder folder;
    bake_large(folder / "with.lbea", large, true);
    bake_large(folder / "without.lbea", large, std::nullopt);
    const Model with = Model::open(folder / "with.lbea"), without = Model::open(folder / "without.lbea");
    CHECK(without.view().landmark_positions.empty());
    CHECK(with.bytes() == std::filesystem::file_size(folder / "with.lbea"));
    CHECK(with.hot_bytes(Method::vtp) == with.bytes());
    const bool is_small = with.vertices() <= format::most_surface_landmarks;
    if (!is_small) CHECK(with.hot_bytes() < without.hot_bytes());
    for (const Method method : {Method::lbea, Method::fit}) {
      Matcher a(with, {.max_points = 4096, .method = method}), b(without, {.max_points = 4096, .method = method});
      for (std::uint32_t run = 0; run < large.runs; ++run)
        for (std::uint32_t step = 0; step < large.steps; ++step) {
          std::vector<Point> points = frame_of(large, run, step);
          points.resize(points.size() * (1 + step) / large.steps);  // a part of the surface
          const MatchResult mine = a.match({1, 0, points}), other = b.match({1, 0, points});
          REQUIRE(mine.matches.size() == other.matches.size());
          for (std::size_t k = 0; k < mine.matches.size(); ++k) {
            CHECK(mine.matches[k].sample == other.matches[k].sample);
            CHECK(mine.matches[k].distance == other.matches[k].distance);
          }
          if (is_small)
            CHECK(mine.coverage == other.coverage);
          else  // one vertex in two or three: the border of what is seen is what they differ by
            CHECK(std::abs(mine.coverage - other.coverage) < 0.03f);
        }
    }
  }
}

TEST_CASE("landmarks do not depend on shards and threads") {
  const CountedPlates plates = counted_plates(4);
  EnsembleDescription description = shard_description(ReferenceMode::over_time);
  description.landmarks = true;
  const TemporaryFolder folder;
  const WorkFolder work(folder / "work", false);
  const BakePlan plan = plan_bake(work, plates.ensemble, description, shard_options());
  for (const std::uint32_t index : {1u, 0u}) bake_shard(work, plan, {index, 2}, shard_options());
  CHECK(merged(work, plan) == baked_alone(plates.ensemble, description));
}

TEST_CASE("a model larger than its memory limit is opened, locked and matched without reading from the disk" *
          doctest::skip(is_instrumented)) {
  const bool is_long = is_long_run();  // 1.2 GB of positions: landmarks by themselves; else 20 MB
  const LargeModel large =
      is_long ? LargeModel{100, 100, {100, 100, 400, 400}} : LargeModel{8, 20, {100, 100, 400, 400}};
  const TemporaryFolder folder;
  const auto file = folder / "large.lbea";
  bake_large(file, large, is_long ? std::nullopt : std::optional(true));
  forget_file(file);
  if (!is_forgotten(file)) {
    MESSAGE("this file system keeps files in memory: not measured");
    return;
  }
  const std::uint64_t bytes = std::filesystem::file_size(file);
  in_a_process({}, [&](const BakeOptions&) {
    const auto require = [](bool holds, const char* what) {
      if (holds) return;
      std::fprintf(stderr, "%s\n", what);
      throw std::runtime_error(what);
    };
    std::ofstream("/proc/self/clear_refs") << 5;  // the peak is counted from here
    const long before_kb = status_kb("VmRSS");
    const Model model = Model::open(file);
    const std::uint64_t hot = model.hot_bytes();
    const long peak_kb = status_kb("VmHWM") - before_kb, kept_kb = status_kb("VmRSS") - before_kb;
    std::fprintf(stderr, "model %.0f MB, hot %.0f MB; opening it: peak %.0f MB, kept %.0f MB\n",
                 1e-6 * static_cast<double>(bytes), 1e-6 * static_cast<double>(hot),
                 1e-3 * static_cast<double>(peak_kb), 1e-3 * static_cast<double>(kept_kb));
    require(hot < bytes / 4, "more than a quarter is hot");
    require(peak_kb < static_cast<long>(hot / 1000) + 16'000, "opening takes more memory than what is hot");

    Matcher matcher(model, {.max_points = 16'384}), fitter(model, {.max_points = 16'384, .method = Method::fit});
    // As lbea-serve --lock-memory does: lock everything first, then unlock the cold part of the model.
    const bool may_lock = ::mlockall(MCL_CURRENT | MCL_FUTURE | MCL_ONFAULT) == 0;
    const long all_kb = status_kb("VmLck");
    const bool is_locked = model.lock();
    if (!may_lock || !is_locked) std::perror("the system lets this user lock too little memory");
    require(!may_lock || is_locked, "not locked, although everything may be");
    require(!may_lock || all_kb - status_kb("VmLck") > static_cast<long>((bytes - hot) / 1024 * 9 / 10),
            "the cold sections are still locked");
    std::vector<std::vector<Point>> frames;
    for (std::uint32_t run = 0; run < large.runs; ++run) frames.push_back(frame_of(large, run, run % large.steps));
    (void)matcher.match({0, 0, frames[0]});
    (void)fitter.match({0, 0, frames[0]});
    forget_file(file);
    double cold_kept = 0;
    for (const auto part : model.view().cold) cold_kept += share_in_memory(part) * static_cast<double>(part.size());
    require(cold_kept < 0.05 * static_cast<double>(bytes - hot), "the cold sections are still in memory");
    const long faults = major_faults();
    for (std::uint32_t run = 0; run < large.runs; ++run) {
      const MatchResult result = matcher.match({run, 0, frames[run]});
      require(result.matches.front().sample == Sample{run, run % large.steps}, "another sample than the frame's");
      require(result.coverage > 0.99f, "a frame that covers everything");
      require(fitter.match({run, 0, frames[run]}).fit.candidates.size() > 1, "nothing was fitted");
    }
    const long of_matching = major_faults() - faults;
    // Cold sections are read on demand.
    const std::uint32_t sample = model.sample_index({large.runs - 1, 1});
    const std::vector<Point> expected = frame_of(large, large.runs - 1, 1);
    const auto positions = model.node_positions(sample);
    for (std::size_t i = 0; i < expected.size(); ++i)
      require(positions[3 * i] == expected[i].x, "positions from the disk are others");
    std::fprintf(stderr, "%u frames: %ld major faults; then one sample's positions: %ld\n", large.runs, of_matching,
                 major_faults() - faults - of_matching);
    require(of_matching == 0, "matching read from the disk");
    require(major_faults() > faults, "the cold part was in memory all along");
  });
}
