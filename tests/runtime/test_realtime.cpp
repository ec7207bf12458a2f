// match() promises: no allocation. Every way to the heap is counted here, over 10,000 frames, malformed ones included.
#include "runtime/src/fit/surface_fit.hpp"
#include "runtime/src/match/sample_search.hpp"
#include "tests/runtime/fit/seen_plates.hpp"
#include "tests/runtime/frames.hpp"

#include <lbea/lbea.h>
#include <lbea/components.hpp>
#include <lbea/forecast.hpp>
#include <lbea/rigs.hpp>
#include <lbea/tracker.hpp>

#include <lbea/test_history.hpp>

#include <doctest/doctest.h>

#include <algorithm>
#include <atomic>
#include <limits>
#include <random>

namespace {
thread_local std::uint64_t heap_calls = 0, heap_bytes = 0;
}

// glibc's own doors, so that also plain malloc in a library is seen.
extern "C" {
void* __libc_malloc(std::size_t);
void __libc_free(void*);
void* __libc_calloc(std::size_t, std::size_t);
void* __libc_realloc(void*, std::size_t);

void* malloc(std::size_t size) { return ++heap_calls, heap_bytes += size, __libc_malloc(size); }
void free(void* memory) { ++heap_calls, __libc_free(memory); }
void* calloc(std::size_t count, std::size_t size) {
  return ++heap_calls, heap_bytes += count * size, __libc_calloc(count, size);
}
void* realloc(void* memory, std::size_t size) { return ++heap_calls, heap_bytes += size, __libc_realloc(memory, size); }
}

using namespace lbea;
using namespace lbea::bake;
using namespace lbea::test;

namespace {

/// Of a plate that bends; every third one shows half of it.
std::vector<std::vector<Point>> bending_clouds() {
  std::vector<std::vector<Point>> clouds;
  for (int step = 0; step < 24; ++step) {
    clouds.push_back(seen(bent(0.03 * step), {}, static_cast<std::uint64_t>(step)));
    if (step % 3 == 2) clouds.back().resize(clouds.back().size() / 2);
  }
  return clouds;
}

}  // namespace

TEST_CASE("10,000 frames, malformed ones included, without one call to the heap") {
  const TemporaryFolder folder;
  EnsembleDescription description = bent_plates_description(ReferenceMode::over_time);
  description.channels = {{"free end", ChannelKind::velocity, ChannelComponent::z, 150, {{true, 1020, {}}}, {}}};
  bake_model(bent_plates(), description, folder / "plates.lbea", with_views());
  const AlignedBytes bytes(folder / "plates.lbea");
  const Model model = Model::view(bytes.span());
  constexpr float nan = std::numeric_limits<float>::quiet_NaN();
  std::vector<std::vector<Point>> frames{{},
                                         std::vector<Point>(100, Point{nan, 0, 0}),
                                         std::vector<Point>(5'000, Point{1, 1, 1}),
                                         std::vector<Point>(300, Point{1e30f, 0, 0}),
                                         {{5, 5, 5}}};
  for (const std::uint32_t s : {0u, 5u, 11u, 23u}) frames.push_back(points_of(model, s));
  for (const Method method : {Method::lbea, Method::vtp, Method::fit}) {
    MatcherConfig config = fit_config();  // the plates' frames are in reference coordinates
    config.T_reference_sensor = identity_transform;
    config.max_points = 1'000;
    config.method = method;
    Matcher matcher(model, config);
    Tracker tracker(model);
    std::uint64_t matched = 0, refused = 0;
    const std::uint64_t before = heap_calls;
    for (std::uint64_t id = 0; id < 10'000; ++id) {
      const MatchResult result = matcher.match(
          {.id = id, .stamp_ns = static_cast<std::int64_t>(id * 1'000'003), .points = frames[id % frames.size()]});
      tracker.update(result);
      (result.channels.empty() ? refused : matched) += 1;
    }
    CHECK(heap_calls == before);
    CHECK(matched > 4'000);
    CHECK(refused > 4'000);
  }
  CHECK(heap_calls > 0);  // the counter counts
}

TEST_CASE("frames of which something hides a part are matched without one call to the heap") {
  const TemporaryFolder folder;
  bake_model(similar_plates(4, 6), bent_plates_description(), folder / "plates.lbea", with_views());
  const Model model = Model::open(folder / "plates.lbea");
  DepthImages images = *SensorViews::baked_into(model).data();
  images.regression.blend = images.regression.hidden_blend = 0.5f;
  images.regression.hidden_most_difference = 10;
  SurfaceFitter fitter(model.view(), SensorViews(std::make_shared<const DepthImages>(images)), 3);
  std::vector<RankedSample> all;
  for (std::uint32_t s = 0; s < model.samples(); ++s) all.push_back({s, 0});
  std::vector<float> observed(padded_cells(images.camera));
  const std::uint64_t before = heap_calls;
  for (std::uint32_t s = 0; s < model.samples(); ++s) {
    const auto image = images.of_sample(s);
    for (std::size_t c = 0; c < observed.size(); ++c)
      observed[c] = image[c] == empty_cell || c % images.camera.columns < images.camera.columns / 3
                        ? nothing_seen
                        : static_cast<float>(image[c]);
    fitter.fit({.observed = observed, .is_hidden = true}, all);
  }
  CHECK(heap_calls == before);
}

TEST_CASE("the history of a test, with the pose estimated, and forecasts take no call to the heap") {
  const TemporaryFolder folder;
  bake_model(similar_plates(4, 6), bent_plates_description(), folder / "plates.lbea", with_views());
  const Model model = Model::open(folder / "plates.lbea");
  DepthImages images = *SensorViews::baked_into(model).data();
  images.pose_variance = 1;
  images.pose_errors.drift_evidence = 6;
  images.pose_errors_by_points = images.pose_errors;
  images.time_variation = 0.1f;
  images.regression.blend = 0.5f;
  const SensorViews views(std::make_shared<const DepthImages>(images));
  Matcher matcher(model, fit_config(), views);
  TestHistory history(model, views);
  REQUIRE(history.estimates_pose());
  Forecast forecast(model);
  const std::vector<std::vector<Point>> clouds = bending_clouds();
  const std::uint64_t before = heap_calls;
  for (std::uint64_t id = 0; id < clouds.size(); ++id)
    forecast.update(matcher.match({id, static_cast<std::int64_t>(id) * 1'000'000, clouds[id]}, history));
  CHECK(heap_calls == before);
  CHECK(forecast.state().frames > 0);
}

TEST_CASE("captures of two rigs, one of them hidden in part or without points, take no call to the heap") {
  const TemporaryFolder folder;
  bake_model(similar_plates(4, 6), bent_plates_description(), folder / "plates.lbea", with_views());
  const Model model = Model::open(folder / "plates.lbea");
  DepthImages images = *SensorViews::baked_into(model).data();
  images.pose_variance = 1;
  images.pose_errors_by_points = images.pose_errors;
  const Rig rig{fit_config().T_reference_sensor, SensorViews(std::make_shared<const DepthImages>(images))};
  RigMatcher matcher(model, fit_config(), {rig, rig});
  std::vector<std::vector<Point>> clouds = bending_clouds();
  clouds.push_back({{5, 5, 5}});
  clouds.emplace_back();
  std::uint64_t used = 0;
  const std::uint64_t before = heap_calls;
  for (std::uint64_t id = 0; id < clouds.size(); ++id) {
    const std::int64_t stamp_ns = static_cast<std::int64_t>(id) * 1'000'000;
    const std::array frames{Frame{id, stamp_ns, clouds[id]}, Frame{id, stamp_ns, clouds[clouds.size() - 1 - id]}};
    const MatchResult result = matcher.match(frames);
    for (const RigResult& one : matcher.rigs()) used += one.is_used && result.fit.residual >= 0 ? 1 : 0;
  }
  CHECK(heap_calls == before);
  CHECK(used > 24);
}

TEST_CASE("captures of two rigs through the C interface take no call to the heap") {
  const TemporaryFolder folder;
  bake_model(similar_plates(4, 6), bent_plates_description(), folder / "plates.lbea", with_views());
  lbea_model* model = nullptr;
  REQUIRE(lbea_model_open((folder / "plates.lbea").c_str(), &model) == LBEA_OK);
  lbea_rig rig{};
  rig.struct_size = sizeof rig;
  std::ranges::copy(fit_config().T_reference_sensor, rig.T_reference_sensor);
  const std::array rigs{rig, rig};
  lbea_rig_matcher* matcher = nullptr;
  REQUIRE(lbea_rig_matcher_create(model, nullptr, rigs.data(), 2, &matcher) == LBEA_OK);
  const std::vector<std::vector<Point>> clouds = bending_clouds();
  lbea_result result{};
  result.struct_size = sizeof result;
  lbea_rig_result of_rig{};
  of_rig.struct_size = sizeof of_rig;
  std::uint64_t used = 0;
  const std::uint64_t before = heap_calls;
  for (std::uint64_t id = 0; id < clouds.size(); ++id) {
    const auto* points = reinterpret_cast<const lbea_point*>(clouds[id].data());
    const lbea_frame frame{sizeof frame, id, static_cast<std::int64_t>(id) * 1'000'000, points, clouds[id].size()};
    const std::array frames{frame, frame};
    lbea_rig_matcher_match(matcher, frames.data(), 2, &result);
    lbea_rig_matcher_match(matcher, frames.data(), 1, &result);  // refused
    lbea_rig_matcher_get_rig(matcher, 1, &of_rig);
    used += of_rig.is_used == 1 ? 1 : 0;
  }
  CHECK(heap_calls == before);
  CHECK(used > clouds.size() / 2);
  lbea_rig_matcher_destroy(matcher);
  lbea_model_close(model);
}

TEST_CASE("the test of two components takes no call to the heap") {
  const TemporaryFolder folder;
  bake_model(similar_plates(4, 6), bent_plates_description(), folder / "plates.lbea", with_views());
  const Model model = Model::open(folder / "plates.lbea");
  Matcher first(model, fit_config()), second(model, fit_config());
  ComponentTracker tracker({{model}, {model}});
  std::vector<std::vector<Point>> clouds = bending_clouds();
  clouds.insert(clouds.begin(), 4, seen(bent(0)));
  clouds.push_back({{5, 5, 5}});
  clouds.emplace_back();
  const std::uint64_t before = heap_calls;
  for (std::uint64_t id = 0; id < clouds.size(); ++id) {
    const std::array results{first.match({id, 0, clouds[id]}), second.match({id, 0, clouds[clouds.size() - 1 - id]})};
    tracker.update(results);
  }
  CHECK(heap_calls == before);
  CHECK(tracker.state(1).frames > 24);
}

TEST_CASE("the same through the C interface") {
  const TemporaryFolder folder;
  bake_model(bent_plates(), bent_plates_description(), folder / "plates.lbea");
  lbea_model* model = nullptr;
  REQUIRE(lbea_model_open((folder / "plates.lbea").c_str(), &model) == LBEA_OK);
  lbea_config config;
  REQUIRE(lbea_config_init(&config, sizeof config) == LBEA_OK);
  lbea_matcher* matcher = nullptr;
  REQUIRE(lbea_matcher_create(model, &config, &matcher) == LBEA_OK);
  const auto points = points_of(Model::open(folder / "plates.lbea"), 5);
  std::vector<lbea_point> c_points;
  for (const Point& p : points) c_points.push_back({p.x, p.y, p.z});
  lbea_frame frame{sizeof(lbea_frame), 0, 0, nullptr, 0};
  lbea_result result;
  result.struct_size = sizeof result;
  const std::uint64_t before = heap_calls;
  std::uint64_t matched = 0, refused = 0;
  for (std::uint64_t id = 0; id < 1'000; ++id) {
    frame.id = id;
    frame.points = id % 2 == 0 ? c_points.data() : nullptr;
    frame.point_count = id % 2 == 0 ? c_points.size() : 0;
    (lbea_matcher_match(matcher, &frame, &result) == LBEA_OK && result.match_count > 0 ? matched : refused) += 1;
  }
  CHECK(heap_calls == before);
  CHECK(matched == 500);
  CHECK(refused == 500);
  lbea_matcher_destroy(matcher);
  lbea_model_close(model);
}

TEST_CASE("a matcher for 62,000 points takes less than 16 MiB beside its model") {
  const TemporaryFolder folder;
  bake_model(bent_plates(), bent_plates_description(), folder / "plates.lbea", with_views());
  const Model model = Model::open(folder / "plates.lbea");
  for (const Method method : {Method::lbea, Method::vtp, Method::fit}) {
    MatcherConfig config = fit_config();
    config.max_points = 62'000;
    config.method = method;
    const std::uint64_t before = heap_bytes;
    const Matcher matcher(model, config);
    const std::uint64_t bytes = heap_bytes - before;
    MESSAGE(bytes, " bytes");
    CHECK(bytes < 16u << 20);
  }
}

TEST_CASE("many samples are searched without one call to the heap") {
  constexpr std::size_t samples = 3'000, modes = 20;
  Positions e(modes);
  std::mt19937 random(1);
  std::normal_distribution<float> value(0, 1);
  std::vector<float> table(samples * 3 * e.planes[0].size());
  std::ranges::generate(table, [&] { return value(random); });
  const SampleTree tree(table, modes);
  BestSamples best(5);
  const std::uint64_t before = heap_calls;
  for (int query = 0; query < 100; ++query) {
    for (auto& plane : e.planes) std::generate_n(plane.begin(), modes, [&] { return value(random); });
    tree.search(e, best);
  }
  CHECK(heap_calls == before);
  CHECK(best.ranked().size() == 5);
}
