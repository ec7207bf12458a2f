// Channels of elements and nodes that runs lose.
#include "precompute/jobs/jobs.hpp"
#include "runtime/src/channels/learned_channels.hpp"
#include "tests/precompute/survey/eroding_model.hpp"
#include "tests/support/refusals.hpp"

#include <doctest/doctest.h>

#include <algorithm>

using namespace lbea;
using namespace lbea::bake;
using namespace lbea::test;

TEST_CASE("fields of eroded elements do not count in channels") {
  const Model model = Model::view(eroding_model().span());
  for (std::uint32_t s = 0; s < model.samples(); ++s) {
    float largest = 0;
    for (const float value : model.field_values(0, s)) largest = std::max(largest, value);  // NaN is not larger
    CHECK(model.channel_value(0, s) == largest);
    CHECK(largest < 10);
  }
  EnsembleDescription description = bent_plates_description();
  description.channels.push_back(strain_channel("patch", ChannelKind::mean));
  for (const std::size_t element : patch_elements())
    description.channels[0].elements.push_back(plate_mesh().element_ids[element]);
  const TemporaryFolder folder;
  check_error(error_of([&] { bake_model(eroding_plates(1, steps, from), description, folder / "m.lbea"); }),
              Status::bad_input, {"run eroding_0, state 4", "all elements of channel 'patch' are eroded"});
}

TEST_CASE("channels of nodes that a run loses are refused, before a shard is baked, too") {
  const auto id_of = [](std::size_t node) { return plate_mesh().node_ids[node]; };
  const ChannelPoint inner{true, id_of(patch_nodes()[4]), {}}, corner{true, id_of(0), {}}, beside{true, id_of(1), {}},
      above{true, id_of(PlateShape{}.columns), {}};
  const std::string node = "node " + std::to_string(inner.node) + ", which flies freely in run eroding_0, state 4";
  const std::vector<ChannelDescription> refused{
      {"moved", ChannelKind::displacement, ChannelComponent::z, 0, {inner}, {}},
      {"fast", ChannelKind::velocity, ChannelComponent::z, 150, {inner}, {}},
      {"far", ChannelKind::distance, ChannelComponent::resultant, 0, {corner, inner}, {}},
      {"deep", ChannelKind::intrusion, ChannelComponent::z, 0, {above, corner, beside, inner}, {}}};
  for (const ChannelDescription& channel : refused) {
    EnsembleDescription description = bent_plates_description();
    description.channels = {channel};
    const TemporaryFolder folder;
    const WorkFolder work(folder / "work");
    const std::string name = "channel '" + channel.name + "'";
    BakeOptions options;
    options.leaves_out_broken = true;
    check_error(error_of([&] { bake_model(eroding_plates(1, steps, from), description, folder / "m.lbea", options); }),
                Status::bad_config, {name.c_str(), node.c_str(), "choose another node"});
    check_error(error_of([&] { (void)plan_bake(work, eroding_plates(1, steps, from), description, options); }),
                Status::bad_config, {name.c_str(), node.c_str()});
  }
}

TEST_CASE("a channel ends with its node: later states, which are not used, do not reach back into it") {
  constexpr std::uint32_t long_steps = 9, late = 6;
  ChannelDescription channel{"fast", ChannelKind::velocity, ChannelComponent::z, 150, {}, {}};
  channel.points = {{true, plate_mesh().node_ids[patch_nodes()[4]], {}}};
  EnsembleDescription description = bent_plates_description();
  description.channels = {channel};
  description.steps.last = late - 1;
  Ensemble cut = eroding_plates(1, long_steps, late);
  cut.runs[1].open = [] {
    SyntheticSimulation whole = eroding_plate(0.5, long_steps, late);
    std::vector<SimulationState> states(late);
    for (std::uint32_t step = 0; step < late; ++step) whole.read(step, states[step]);
    return std::make_unique<SyntheticSimulation>(whole.mesh(), std::move(states), whole.fields());
  };
  const TemporaryFolder folder;
  bake_model(eroding_plates(1, long_steps, late), description, folder / "eroding.lbea");
  bake_model(cut, description, folder / "cut.lbea");
  const Model eroding = Model::open(folder / "eroding.lbea"), expected = Model::open(folder / "cut.lbea");
  REQUIRE(eroding.samples() == 2 * late);
  for (std::uint32_t s = late; s < eroding.samples(); ++s)
    CHECK(eroding.channel_value(0, s) == expected.channel_value(0, s));
}
