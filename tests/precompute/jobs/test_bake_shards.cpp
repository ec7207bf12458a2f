// Bakes in shards: the model has the bytes of a single process, whichever processes are killed and however the runs are
// divided.
#include "runtime/src/model/model_view.hpp"
#include "tests/precompute/jobs/shard_plates.hpp"
#include "tests/support/eroding_plates.hpp"
#include "tests/support/refusals.hpp"

#include <algorithm>
#include <random>

using namespace lbea;
using namespace lbea::bake;
using namespace lbea::test;

namespace {

class Schedule {
 public:
  explicit Schedule(unsigned seed) : random_(seed) {}

  int below(int end) { return std::uniform_int_distribution<int>(0, end - 1)(random_); }
  /// Runs `body` in a process that may be killed at any point.
  void run(const std::function<void(const BakeOptions&)>& body) {
    const Death when = death();
    const bool lived = in_a_process(when, body, static_cast<unsigned>(1 + below(3))).peak_kb > 0;
    ++(lived ? lived_ : died_);
  }
  [[nodiscard]] unsigned died() const noexcept { return died_; }
  [[nodiscard]] unsigned lived() const noexcept { return lived_; }

  Shard shard() {
    const auto of = static_cast<std::uint32_t>(1 + below(5));
    return {static_cast<std::uint32_t>(below(static_cast<int>(of))), of};
  }

 private:
  Death death() {
    switch (below(5)) {
      case 0:
      case 1:
        return {1 + below(8), 0};
      case 2:
      case 3:
        return {0, 50L + below(2500)};
      default:
        return {};
    }
  }

  std::mt19937 random_;
  unsigned died_ = 0, lived_ = 0;
};

/// Some attempts to plan, most of them killed at some point.
void plan_through(Schedule& schedule, const WorkFolder& work, const Ensemble& ensemble,
                  const EnsembleDescription& description) {
  for (int tries = schedule.below(3); tries > 0; --tries)
    schedule.run([&](const BakeOptions& options) {
      schedule.below(2) == 0 ? survey_shard(work, ensemble, description, schedule.shard(), options)
                             : static_cast<void>(plan_bake(work, ensemble, description, options));
    });
}

std::string through_kills(Schedule& schedule, const CountedPlates& plates, const EnsembleDescription& description) {
  const TemporaryFolder folder;
  const WorkFolder work(folder / "work", false);
  plan_through(schedule, work, plates.ensemble, description);
  const BakePlan plan = plan_bake(work, plates.ensemble, description, shard_options(1));
  for (int tries = schedule.below(8); tries > 0; --tries) {
    const Shard shard = schedule.shard();
    schedule.run([&](const BakeOptions& options) { bake_shard(work, plan, shard, options); });
  }
  const auto of = static_cast<std::uint32_t>(1 + schedule.below(6));
  for (std::uint32_t index = 0; index < of; ++index) bake_shard(work, plan, {index, of}, shard_options(1));
  schedule.run([&](const BakeOptions& options) { merge_shards(work, plan, folder / "m.lbea", options); });
  merge_shards(work, plan, folder / "m.lbea", shard_options(2));
  for (const auto& entry : std::filesystem::recursive_directory_iterator(work.path()))
    CHECK_FALSE(contains(entry.path().string(), ".tmp-"));  // no temporary files of killed processes
  return text_of(folder / "m.lbea");
}

}  // namespace

TEST_CASE("any schedule of kills, shard counts and re-runs gives the bytes of a single process") {
  const unsigned schedules = is_long_run() ? 200 : 12;
  const CountedPlates plates = counted_plates(5);
  unsigned died = 0, lived = 0;
  for (const ReferenceMode mode : {ReferenceMode::impact, ReferenceMode::over_time}) {
    EnsembleDescription description = shard_description(mode);
    description.compact_fields = mode == ReferenceMode::over_time;
    const std::string alone = baked_alone(plates.ensemble, description);
    REQUIRE_FALSE(alone.empty());
    for (unsigned seed = 0; seed < schedules / 2; ++seed) {
      CAPTURE(seed);
      Schedule schedule(seed);
      const bool is_same = through_kills(schedule, plates, description) == alone;
      CHECK(is_same);
      died += schedule.died();
      lived += schedule.lived();
    }
  }
  MESSAGE(died << " processes died, " << lived << " lived");
  CHECK(died > schedules);
  CHECK(lived > schedules / 2);
}

TEST_CASE("finished runs are not read again") {
  const CountedPlates plates = counted_plates(4);
  const TemporaryFolder folder;
  const WorkFolder work(folder / "work", false);
  const BakePlan plan = plan_bake(work, plates.ensemble, shard_description(), shard_options());
  bake_shard(work, plan, {1, 2}, shard_options());
  const int of_run_1 = *plates.reads[1];
  const ShardSummary again = bake_shard(work, plan, {0, 1}, shard_options());
  CHECK(again.runs == 4);
  CHECK(again.finished == 2);
  CHECK(*plates.reads[1] == of_run_1);
  CHECK(of_run_1 == 2 * 3);  // surveyed and projected, each state once
}

TEST_CASE("runs are added and removed without reading the others, also when the ensemble's box changes") {
  const CountedPlates plates = counted_plates(6);
  const TemporaryFolder folder;
  const WorkFolder work(folder / "work", false);
  const auto bake_some = [&](const std::vector<std::size_t>& runs) {
    Ensemble some{{}, plates.ensemble.parameter_names, 0};
    for (const std::size_t run : runs) some.runs.push_back(plates.ensemble.runs[run]);
    const BakePlan plan = plan_bake(work, some, shard_description(), shard_options());
    bake_shard(work, plan, {}, shard_options());
    const std::string model = merged(work, plan);
    std::vector<int> reads;
    for (const std::size_t run : runs) reads.push_back(*plates.reads[run]);
    CHECK(model == baked_alone(some, shard_description()));
    for (std::size_t i = 0; i < runs.size(); ++i) *plates.reads[runs[i]] = 0;
    return reads;
  };
  CHECK(bake_some({0, 3, 4}) ==
        std::vector<int>{7, 6, 6});  // the reference mesh is one of run 0's states, read once more
  CHECK(bake_some({0, 3, 4, 5}) == std::vector<int>{1, 0, 0, 6});
  CHECK(bake_some({0, 1, 2, 3, 4, 5}) == std::vector<int>{1, 6, 6, 0, 0, 0});  // runs 1 and 2 bend the farthest
  CHECK(bake_some({0, 2, 5}) == std::vector<int>{1, 0, 0});
  CHECK(bake_some({0, 3, 4}) == std::vector<int>{1, 0, 0});
}

TEST_CASE("a run that loses elements late is added without reading the others; shards give the same bytes") {
  CountedPlates plates = counted_plates(4);
  plates.ensemble.runs[3].open = [] {
    return std::make_unique<SyntheticSimulation>(eroding_plate(0.7, 3, 2, {8, 5, 70, 40}));
  };
  const TemporaryFolder folder;
  const WorkFolder work(folder / "work", false);
  Ensemble three = plates.ensemble;
  three.runs.pop_back();
  const BakePlan before = plan_bake(work, three, shard_description(), shard_options());
  bake_shard(work, before, {}, shard_options());
  CHECK(merged(work, before) == baked_alone(three, shard_description()));
  for (const auto& reads : plates.reads) *reads = 0;
  const BakePlan plan = plan_bake(work, plates.ensemble, shard_description(), shard_options());
  for (const std::uint32_t index : {1u, 0u}) bake_shard(work, plan, {index, 2}, shard_options());
  CHECK(*plates.reads[0] == 1);  // the reference mesh
  CHECK(*plates.reads[1] == 0);
  CHECK(*plates.reads[2] == 0);
  const std::string model = merged(work, plan);
  CHECK(model == baked_alone(plates.ensemble, shard_description()));
  std::ofstream(folder / "m.lbea", std::ios::binary) << model;
  CHECK(Model::open(folder / "m.lbea").view().eroded.size() == 4 * 3);  // samples; 28 elements are one word
}

TEST_CASE("a broken run is left out and named") {
  CountedPlates plates = counted_plates(4);
  const std::string without = [&] {
    Ensemble rest = plates.ensemble;
    rest.runs.erase(rest.runs.begin() + 2);
    return baked_alone(rest, shard_description());
  }();
  const TemporaryFolder folder;
  std::ofstream(folder / "without.lbea", std::ios::binary) << without;
  const Model expected = Model::open(folder / "without.lbea");
  const auto healthy = plates.ensemble.runs[2].open;
  const auto broken = []() -> std::unique_ptr<SimulationReader> {
    throw Error(Status::bad_input, "d3plot ends at byte 17");
  };
  for (const bool breaks_early : {true, false}) {
    CAPTURE(breaks_early);
    const WorkFolder work(folder / (breaks_early ? "early" : "late"), false);
    plates.ensemble.runs[2].open = breaks_early ? broken : healthy;
    BakePlan plan = plan_bake(work, plates.ensemble, shard_description(), shard_options());
    plan.ensemble.runs[2].open = broken;
    const ShardSummary shard = bake_shard(work, plan, {}, shard_options());
    CHECK(shard.failed == (breaks_early ? 0 : 1));
    CHECK(run_status(work, plan)[2].progress == RunProgress::failed);
    CHECK(contains(run_status(work, plan)[2].reason, "d3plot ends at byte 17"));
    const BakeSummary summary = merge_shards(work, plan, folder / "m.lbea", shard_options());
    REQUIRE(summary.left_out.size() == 1);
    CHECK(summary.left_out[0].name == "plate_2");
    CHECK(contains(summary.left_out[0].reason, "d3plot ends at byte 17"));
    const Model model = Model::open(folder / "m.lbea");
    CHECK(contains(std::string(model.provenance()), "\"left_out\":[\"plate_2\"]"));
    CHECK_FALSE(contains(std::string(expected.provenance()), "left_out"));
    REQUIRE(model.samples() == expected.samples());
    for (std::uint32_t s = 0; s < model.samples(); ++s)
      CHECK(std::ranges::equal(model.node_positions(s), expected.node_positions(s)));
  }
  plates.ensemble.runs[2].open = healthy;  // repaired: only the failed run is made
  const WorkFolder work(folder / "late", false);
  const BakePlan plan = plan_bake(work, plates.ensemble, shard_description(), shard_options());
  CHECK(bake_shard(work, plan, {}, shard_options()).finished == 3);
  CHECK(merged(work, plan) == baked_alone(plates.ensemble, shard_description()));
}

TEST_CASE("a broken reference run ends the plan; with leaves_out_broken off, every broken run does") {
  CountedPlates plates = counted_plates(3);
  const TemporaryFolder folder;
  const auto broken = []() -> std::unique_ptr<SimulationReader> {
    throw Error(Status::bad_input, "d3plot ends at byte 17");
  };
  plates.ensemble.runs[1].open = broken;
  BakeOptions strict = shard_options();
  strict.leaves_out_broken = false;
  check_error(
      error_of([&] { (void)plan_bake(WorkFolder(folder / "a"), plates.ensemble, shard_description(), strict); }),
      Status::bad_input, {"byte 17"});
  plates.ensemble.reference_run = 1;
  check_error(error_of([&] {
                (void)plan_bake(WorkFolder(folder / "b"), plates.ensemble, shard_description(), shard_options());
              }),
              Status::bad_input, {"byte 17"});
}

TEST_CASE("merge names what is missing and what is damaged, and leaves no model") {
  const CountedPlates plates = counted_plates(3);
  const TemporaryFolder folder;
  const WorkFolder work(folder / "work", false);
  const BakePlan plan = plan_bake(work, plates.ensemble, shard_description(), shard_options());
  bake_shard(work, plan, {0, 2}, shard_options());
  const auto refused = [&] {
    const Error error = error_of([&] { merge_shards(work, plan, folder / "m.lbea", shard_options()); });
    CHECK(files_in(folder.path()) == 1);  // the work folder
    return error;
  };
  check_error(refused(), Status::bad_input, {"1 of 3 runs are not baked yet: plate_1"});
  bake_shard(work, plan, {1, 2}, shard_options());

  for (const WorkName name :
       {plan.runs[1].record_name(), plan.runs[1].grid_and_images_name(), WorkName{WorkKind::basis, plan.bases[0]}}) {
    const std::string whole = text_of(work.file(name));
    for (std::size_t byte = 40; byte < whole.size(); byte += whole.size() / 17) {
      std::string bytes = whole;
      bytes[byte] = static_cast<char>(bytes[byte] ^ 0x10);
      put(work.file(name), bytes);
      check_error(refused(), Status::bad_input, {work.file(name).string(), "it was removed"});
      CHECK_FALSE(work.has(name));
    }
    put(work.file(name), whole);
  }
  put(work.file(plan.runs[0].record_name()), text_of(work.file(plan.runs[0].record_name())).substr(0, 1000));
  CHECK_FALSE(work.has(plan.runs[0].record_name()));  // truncated: is made again
  bake_shard(work, plan, {}, shard_options());
  CHECK(merged(work, plan) == baked_alone(plates.ensemble, shard_description()));
}

TEST_CASE(
    "damaged files are made again: after merge found them, by a verifying shard, and by a shard that needs "
    "them") {
  const CountedPlates plates = counted_plates(3);
  const std::string alone = baked_alone(plates.ensemble, shard_description());
  const TemporaryFolder folder;
  const WorkFolder work(folder / "work", false);
  BakePlan plan = plan_bake(work, plates.ensemble, shard_description(), shard_options());
  bake_shard(work, plan, {}, shard_options());
  const auto damage = [&](WorkName name) {
    std::string bytes = text_of(work.file(name));
    bytes[bytes.size() / 2] = static_cast<char>(bytes[bytes.size() / 2] ^ 4);
    put(work.file(name), bytes);
  };
  for (const WorkName name : {plan.runs[1].record_name(), plan.runs[1].grid_and_images_name(),
                              plan.runs[1].survey_name(), WorkName{WorkKind::basis, plan.bases[0]}}) {
    damage(name);
    if (name.kind == WorkKind::survey) {  // only needed to make a record
      std::filesystem::remove(work.file(plan.runs[1].record_name()));
      check_error(error_of([&] { bake_shard(work, plan, {}, shard_options()); }), Status::bad_input,
                  {"it was removed, plan again"});
    } else {
      check_error(error_of([&] { merge_shards(work, plan, folder / "m.lbea", shard_options()); }), Status::bad_input,
                  {"it was removed"});
    }
    plan = plan_bake(work, plates.ensemble, shard_description(), shard_options());
    CHECK(bake_shard(work, plan, {}, shard_options()).failed == 0);
    CHECK(merged(work, plan) == alone);
  }
  damage(plan.runs[2].survey_name());
  const int read_before = *plates.reads[2];
  plan = plan_bake(work, plates.ensemble, shard_description(), shard_options());  // surveys the run again
  CHECK(*plates.reads[2] == read_before + 3);
  CHECK(merged(work, plan) == alone);

  BakeOptions verify = shard_options(2);
  verify.verifies_finished = true;
  CHECK(bake_shard(work, plan, {}, verify).finished == 3);
  damage(plan.runs[0].record_name());
  damage(plan.runs[2].grid_and_images_name());
  CHECK(bake_shard(work, plan, {}, shard_options()).finished == 3);
  CHECK(bake_shard(work, plan, {}, verify).finished == 1);
  CHECK(merged(work, plan) == alone);
  damage(plan.runs[0].record_name());
  std::filesystem::remove(work.file(plan.runs[0].grid_and_images_name()));
  CHECK(bake_shard(work, plan, {}, shard_options()).failed == 0);
  CHECK_FALSE(work.failure(plan.runs[0].record));
  CHECK(merged(work, plan) == alone);
}

TEST_CASE("status distinguishes running from killed writers: here at once, on other machines by the last write") {
  const CountedPlates plates = counted_plates(2);
  const TemporaryFolder folder;
  const WorkFolder work(folder / "work", false);
  const BakePlan plan = plan_bake(work, plates.ensemble, shard_description(), shard_options());
  const auto progress = [&](double patience_s = 300) { return run_status(work, plan, patience_s)[1].progress; };
  CHECK(progress() == RunProgress::waiting);
  {
    const WorkWriter record = work.writer(plan.runs[1].record_name());
    CHECK(progress() == RunProgress::running);
    CHECK(progress(0) == RunProgress::running);  // a slow state does not count as killed
  }
  CHECK(progress() == RunProgress::waiting);
  in_a_process({2, 0}, [&](const BakeOptions& options) { bake_shard(work, plan, {1, 2}, options); });
  CHECK(files_in(work.file(plan.runs[1].record_name()).parent_path()) == 1);  // what it left
  CHECK(progress() == RunProgress::waiting);
  const auto elsewhere = work.file(plan.runs[1].record_name()).string() + ".tmp-1-0@another-node.example";
  put(elsewhere, "some of it");
  CHECK(progress() == RunProgress::running);
  std::filesystem::last_write_time(elsewhere,
                                   std::filesystem::file_time_type::clock::now() - std::chrono::seconds(400));
  CHECK(progress() == RunProgress::waiting);
  CHECK(progress(500) == RunProgress::running);
}

TEST_CASE("a sensor other than the planned one and invalid shards are refused") {
  const CountedPlates plates = counted_plates(2);
  const TemporaryFolder folder;
  const WorkFolder work(folder / "work", false);
  const BakePlan plan = plan_bake(work, plates.ensemble, shard_description(), shard_options());
  BakeOptions other = shard_options();
  other.depth_renderer = [](const CommonMesh&, const std::array<float, 3>& low, const std::array<float, 3>&) {
    return std::make_unique<FormulaRenderer>(low, std::array{low[0], low[1], low[2] + 1});
  };
  check_error(error_of([&] { bake_shard(work, plan, {}, other); }), Status::bad_config, {"sensor", "plan again"});
  check_error(error_of([&] {
                bake_shard(work, plan, {2, 2}, shard_options());
              }),
              Status::bad_config, {"no shard 2 of 2"});
}

TEST_CASE("the merge renders the images of further rigs, which have the bytes of a single process") {
  CountedPlates plates = counted_plates(4);
  for (EnsembleRun& run : plates.ensemble.runs) run.source = run.name;
  const auto with_more = [](unsigned threads) {
    BakeOptions options = shard_options(threads);
    for (const float deeper : {10.0f, 20.0f})
      options.more_depth_renderers.push_back(
          [deeper](const CommonMesh&, const std::array<float, 3>& low, const std::array<float, 3>& high) {
            return std::make_unique<FormulaRenderer>(std::array{low[0], low[1], low[2] - deeper}, high);
          });
    return options;
  };
  const TemporaryFolder folder;
  bake_model(plates.ensemble, shard_description(), folder / "alone.lbea", with_more(1));
  const WorkFolder work(folder / "work", false);
  (void)plan_bake(work, plates.ensemble, shard_description(), with_more(1));
  const BakePlan plan = read_plan(work, [&](const std::string& source) {
    return std::ranges::find(plates.ensemble.runs, source, &EnsembleRun::name)->open();
  });
  for (const std::uint32_t shard : {0u, 1u}) bake_shard(work, plan, {shard, 2}, with_more(1));
  const auto file = folder / "merged.lbea";
  check_error(error_of([&] { merge_shards(work, plan, file, shard_options()); }), Status::bad_config,
              {"sensor", "plan again"});
  CHECK_FALSE(std::filesystem::exists(file));
  merge_shards(work, plan, file, with_more(3));
  CHECK(text_of(file) == text_of(folder / "alone.lbea"));
}

TEST_CASE("reading a plan restores what was written") {
  CountedPlates plates = counted_plates(3);
  for (EnsembleRun& run : plates.ensemble.runs) run.source = run.name;
  const TemporaryFolder folder;
  const WorkFolder work(folder / "work", false);
  (void)plan_bake(work, plates.ensemble, shard_description(), shard_options());
  const BakePlan read = read_plan(work, [&](const std::string& source) {
    return std::ranges::find(plates.ensemble.runs, source, &EnsembleRun::name)->open();
  });
  for (const RunStatus& run : run_status(work, read)) CHECK(run.progress == RunProgress::waiting);
  bake_shard(work, read, {}, shard_options());
  for (const RunStatus& run : run_status(work, read)) CHECK(run.progress == RunProgress::finished);
  CHECK(merged(work, read) == baked_alone(plates.ensemble, shard_description()));
  CHECK_THROWS_WITH_AS((void)read_plan(WorkFolder(folder / "none"), {}), doctest::Contains("holds no plan"), Error);
}
