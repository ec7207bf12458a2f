// Where the views of several rigs come from, and which rigs are refused.
#include "tests/runtime/rigs/two_rigs.hpp"

#include <doctest/doctest.h>

#include <algorithm>
#include <string>
#include <vector>

using namespace lbea;
using namespace lbea::bake;
using namespace lbea::test;

TEST_CASE("the views of another rig may come from a model that was baked for it") {
  const TwoRigs two;
  const TemporaryFolder folder;
  BakeOptions options;
  options.depth_renderer = [](const CommonMesh& mesh, const std::array<float, 3>& low,
                              const std::array<float, 3>& high) {
    return make_depth_renderer(rig_below(), mesh.node_ids.size(), mesh.elements, low, high);
  };
  bake_model(similar_plates(6, 8), bent_plates_description(), folder / "below.lbea", options);
  const SensorViews below_views = SensorViews::baked_into(Model::open(folder / "below.lbea"));
  RigMatcher matcher(two.model, fit_config(), {two.rigs[0], {two.sensors[1].T_reference_sensor, below_views}});
  matcher.fix_poses();
  const std::vector<float> positions = positions_of(two.model, 12);
  const auto above = seen_from(two.sensors[0], positions), below = seen_from(two.sensors[1], positions, 2);
  const MatchResult result = matcher.match(std::vector<Frame>{at(1, above), at(1, below)});
  CHECK(distance(two.model, result, positions) < 1e-3);
  CHECK(matcher.rigs()[1].is_used);
}

TEST_CASE("a model that was baked for several rigs has the views of each") {
  const auto rendering = [](const StereoSensor& rig) {
    return [rig](const CommonMesh& mesh, const std::array<float, 3>& low, const std::array<float, 3>& high) {
      return make_depth_renderer(rig, mesh.node_ids.size(), mesh.elements, low, high);
    };
  };
  const TemporaryFolder folder;
  BakeOptions of_both, of_below;
  of_both.depth_renderer = rendering(rig_above());
  of_both.more_depth_renderers = {rendering(rig_below())};
  of_below.depth_renderer = rendering(rig_below());
  bake_model(similar_plates(6, 8), bent_plates_description(), folder / "both.lbea", of_both);
  bake_model(similar_plates(6, 8), bent_plates_description(), folder / "below.lbea", of_below);
  const Model both = Model::open(folder / "both.lbea"), other = Model::open(folder / "below.lbea");
  const RigidTransform above_pose = rig_above().T_reference_sensor, below_pose = rig_below().T_reference_sensor;
  CHECK(SensorViews::baked_into(both).T_reference_sensor() == above_pose);
  CHECK(SensorViews::baked_into(both, above_pose).T_reference_sensor() == above_pose);
  const SensorViews below = SensorViews::baked_into(both, below_pose), expected = SensorViews::baked_into(other);
  CHECK(below.T_reference_sensor() == below_pose);
  CHECK(std::ranges::equal(below.data()->depths, expected.data()->depths));
  CHECK(std::ranges::equal(below.data()->expected, expected.data()->expected));
  CHECK(std::ranges::equal(below.data()->regression.weights, expected.data()->regression.weights));
  CHECK(below.misfit_limit() == expected.misfit_limit());
  REQUIRE(below.data()->bounds.size() == expected.data()->bounds.size());
  for (std::size_t i = 0; i < below.data()->bounds.size(); ++i)
    CHECK(below.data()->bounds[i].per_spread == expected.data()->bounds[i].per_spread);

  RigMatcher by_model(both, fit_config(), {{above_pose}, {below_pose}});
  RigMatcher by_views(both, fit_config(), {{above_pose}, {below_pose, expected}});
  for (const std::uint32_t sample : {12u, 13u, 14u}) {
    const std::vector<float> positions = positions_of(both, sample);
    const auto from_above = seen_from(rig_above(), positions), from_below = seen_from(rig_below(), positions, 2);
    const std::vector<Frame> frames{at(sample, from_above), at(sample, from_below)};
    const MatchResult result = by_model.match(frames), same = by_views.match(frames);
    CHECK(by_model.rigs()[1].is_used);
    CHECK(result.matches.front().sample == same.matches.front().sample);
    CHECK(result.fit.misfit == same.fit.misfit);
    CHECK(distance(both, result, positions) < 1e-3);
  }
  // One rig alone, which is not the first.
  MatcherConfig config = fit_config();
  config.T_reference_sensor = below_pose;
  Matcher matcher(both, config);
  const auto seen = seen_from(rig_below(), positions_of(both, 12));
  CHECK(matcher.match({0, 0, seen}).matches.front().sample == both.sample(12));
}

TEST_CASE("rigs that cannot be matched are refused with their number") {
  TwoRigs two;
  const auto refused = [&](const std::vector<Rig>& rigs) -> std::string {
    try {
      RigMatcher matcher(two.model, fit_config(), rigs);
    } catch (const Error& error) {
      CHECK(error.status == Status::bad_config);
      return error.what();
    }
    return "accepted";
  };
  CHECK(refused({}).starts_with("0 rigs"));
  CHECK(refused(std::vector<Rig>(17, two.rigs[0])).starts_with("17 rigs"));
  Rig mirrored = two.rigs[1];
  mirrored.T_reference_sensor[0] = -1;
  CHECK(refused({two.rigs[0], mirrored}).starts_with("rig 2: "));
  const AlignedBytes other_bytes = seen_plates_model(4, 12);  // as many samples
  const Model other = Model::view(other_bytes.span());
  REQUIRE(other.samples() == two.model.samples());
  Rig of_other = two.rigs[1];
  of_other.views = views_from(two.sensors[1], other);
  CHECK(refused({two.rigs[0], of_other}).find("not those of the same model") != std::string::npos);
}
