// Forecast and channels as the page gets them.
#include "tests/monitor/shown_results.hpp"
#include "tests/support/synthetic_model.hpp"
#include "tools/monitor/scene/packet.hpp"
#include "tools/monitor/scene/scene.hpp"

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>

using namespace lbea;
using namespace lbea::bake;
using namespace lbea::tool;
using namespace lbea::wire;
using namespace lbea::test;

TEST_CASE("the forecast is shown as it was published, and only then") {
  const TemporaryFolder folder;
  bake_bent_plates(folder / "plates.lbea");
  const Model model = Model::open(folder / "plates.lbea");
  SceneBuilder scenes(model, ranges_of(model));
  WireResult result = result_of(3);
  result.model_checksum = model.checksum();
  TestLog log;
  log.add(result);
  CHECK_FALSE(to_json(result).contains("forecast"));
  CHECK_FALSE(read(scenes.build({result, nullptr}, {})).head["sections"].contains("final"));
  CHECK(std::isnan(log.rows().back()[TestLog::final_error_90]));

  result.forecast = {2, 7.5f, {{0, 1.25f}, {2, -0.25f}}, {0.25f, 0.75f}, {{8.5f, 0.5f, 0.875f}, {-1, 2, 0.125f}}};
  const auto forecast = to_json(result)["forecast"];
  CHECK(forecast["error_90"] == 7.5f);
  CHECK(forecast["branches"] == std::vector<float>{0.25f, 0.75f});
  CHECK(forecast["parameters"][0]["value"] == 8.5f);
  CHECK(forecast["parameters"][0]["bound_90"] == 0.5f);
  CHECK(forecast["parameters"][0]["identifiable"] == true);
  CHECK(forecast["parameters"][1]["identifiable"] == false);
  log.add(result);
  CHECK(log.rows().back()[TestLog::final_error_90] == 7.5f);
  CHECK(column_names()[TestLog::final_error_90] == "final_error_90");
  const auto end = read(scenes.build({result, nullptr}, {})).section<float>("final");
  const auto first = model.node_positions(model.sample_index({0, 5})),
             third = model.node_positions(model.sample_index({2, 5}));
  REQUIRE(end.size() == first.size());
  for (std::size_t i = 0; i < end.size(); ++i)
    CHECK(end[i] == doctest::Approx(1.25 * first[i] - 0.25 * third[i]).epsilon(1e-4));
  // Not one of another model.
  result.forecast.runs.push_back({99, 1});
  CHECK_FALSE(read(scenes.build({result, nullptr}, {})).head["sections"].contains("final"));
  result.forecast.runs.pop_back();
  ++result.model_checksum;
  CHECK_FALSE(read(scenes.build({result, nullptr}, {})).head["sections"].contains("final"));
}

TEST_CASE("channels: the page gets names, units, values and bounds; what is not known is null") {
  const TemporaryFolder folder;
  bake_bent_plates(folder / "plates.lbea");
  const Model plain = Model::open(folder / "plates.lbea");
  CHECK(read(model_packet(plain, ranges_of(plain), nullptr)).head["channels"].empty());
  EnsembleDescription description = bent_plates_description();
  description.channels = {
      {"end", ChannelKind::displacement, ChannelComponent::x, 0, {ChannelPoint{true, 1020, {}}}, {}}};
  bake_model(bent_plates(), description, folder / "end.lbea");
  const Model model = Model::open(folder / "end.lbea");
  CHECK(read(model_packet(model, ranges_of(model), nullptr)).head["channels"] ==
        nlohmann::json::parse(R"([{"name": "end", "unit": "mm"}])"));

  WireResult result = result_of(3);
  CHECK_FALSE(to_json(result).contains("channels"));
  result.channels = {{{-12.5f, 0.5f}, "end", "mm", {-100, 4}}, {{7, std::nanf("")}, "speed", "mm/s"}};
  const auto seen = nlohmann::json::parse(to_json(result).dump());
  CHECK(seen["channels"] == nlohmann::json::parse(R"([
      {"name": "end", "value": -12.5, "bound_90": 0.5, "end_value": -100.0, "end_bound_90": 4.0},
      {"name": "speed", "value": 7.0, "bound_90": null, "end_value": null, "end_bound_90": null}])"));
  CHECK(seen["doubtful"] == false);
  result.verdict = WireVerdict::no_simulation_fits;
  CHECK(to_json(result)["doubtful"] == true);
}
