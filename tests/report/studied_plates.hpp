// Tests of plates with quantities of interest, whose values are those of a simulation.
#pragma once

#include "tests/support/synthetic_model.hpp"
#include "tools/report/page/page.hpp"

#include <cmath>

namespace lbea::test {

/// Plates "plate_0" ... of 41 states, every 0.5 ms, with channels "end x" and "end z".
inline AlignedBytes channel_plates() {
  constexpr std::uint32_t free_end = 1020;
  EnsembleDescription description = bent_plates_description();
  description.channels = {
      {"end x", ChannelKind::displacement, ChannelComponent::x, 0, {{true, free_end, {}}}, {}},
      {"end z", ChannelKind::displacement, ChannelComponent::z, 0, {{true, free_end, {}}}, {}},
  };
  const TemporaryFolder folder;
  bake_model(bent_plates({.runs = 4, .steps = 41}), description, folder / "m.lbea");
  return AlignedBytes(folder / "m.lbea");
}

/// Baked once.
inline const AlignedBytes& plates() {
  static const AlignedBytes bytes = channel_plates();
  return bytes;
}

inline Model model() { return Model::view(plates().span()); }

/// A frame of a test, matched with a simulation's sample.
inline wire::WireResult frame_like(const Model& model, std::uint64_t id, double time_s, Sample sample) {
  const std::uint32_t index = model.sample_index(sample);
  wire::WireResult result;
  result.session = 1;
  result.frame_id = id;
  result.stamp_ns = std::llround(time_s * 1e9);
  result.verdict = wire::WireVerdict::matched;
  result.matches = {{sample, std::string(model.simulation_name(sample.simulation)), model.sample_time_s(index), 0.1f}};
  for (std::uint32_t c = 0; c < model.channels(); ++c)
    result.channels.push_back({{model.channel_value(c, index), std::nanf("")},
                               std::string(model.channel(c).name),
                               std::string(model.channel(c).unit)});
  return result;
}

/// The test that shows the simulation, from `begin_s` on the camera's clock: at rest for 2 ms, then a frame per state.
inline std::vector<wire::WireResult> frames_of(const Model& model, std::uint32_t simulation, double begin_s = 0.25) {
  constexpr std::uint32_t at_rest = 4, states = 41;
  std::vector<wire::WireResult> frames;
  for (std::uint32_t i = 0; i < at_rest + states; ++i)
    frames.push_back(frame_like(model, i, begin_s + 0.0005 * i, {simulation, i < at_rest ? 0 : i - at_rest}));
  return frames;
}

/// Studied.
inline tool::TestReport report_of(const AlignedBytes& model, const std::vector<wire::WireResult>& results) {
  tool::TestReport report({}, Model::view(model.span()), "plates.lbea");
  for (std::uint32_t i = 0; i < report.model.simulations(); ++i)
    report.names.emplace_back(report.model.simulation_name(i));
  report.content.tests.push_back({{1, 0}, tool::TestRecord()});
  for (const wire::WireResult& result : results) report.content.tests.back().record.add(result);
  report.test = 0;
  report.channels = tool::study_channels(report.model, *report.record());
  return report;
}

}  // namespace lbea::test
