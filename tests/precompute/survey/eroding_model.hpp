// A model of plates of which every second run loses a patch late.
#pragma once

#include "tests/runtime/fit/seen_plates.hpp"
#include "tests/support/eroding_plates.hpp"

#include <algorithm>
#include <string>
#include <vector>

namespace lbea::test {

constexpr std::uint32_t steps = 6, from = 4, pairs = 3;

inline ChannelDescription strain_channel(const std::string& name, ChannelKind kind) {
  ChannelDescription channel;
  channel.name = name;
  channel.kind = kind;
  channel.field = "plastic_strain";
  return channel;
}

/// Baked once for all cases.
inline const AlignedBytes& eroding_model() {
  static const AlignedBytes bytes = [] {
    EnsembleDescription description = bent_plates_description();
    description.channels.push_back(strain_channel("largest", ChannelKind::maximum));
    const TemporaryFolder folder;
    bake_model(eroding_plates(pairs, steps, from), description, folder / "m.lbea", with_views());
    return AlignedBytes(folder / "m.lbea");
  }();
  return bytes;
}

inline bool has_hole(const Sample& sample) { return sample.simulation % 2 == 1 && sample.time_step >= from; }

inline bool is_in(const std::vector<std::size_t>& list, std::size_t value) {
  return std::ranges::find(list, value) != list.end();
}

}  // namespace lbea::test
