#include "tools/report/content/channels/channel_record.hpp"

#include "tools/shared/answer/doubtful.hpp"

#include <algorithm>
#include <cmath>

namespace lbea::tool {
namespace {

wire::WireVerdict reason_of(const wire::WireResult& doubtful) {
  if (wire::fate_of(doubtful.status) != wire::Fate::matched) return wire::WireVerdict::refused;
  return doubtful.status == wire::WireStatus::low_coverage ? wire::WireVerdict::low_coverage : doubtful.verdict;
}

void add_moment(TestChannel& channel, const ChannelMoment& moment) {
  if (!std::isfinite(moment.value)) return;
  channel.last = moment;
  if (!channel.peak || std::abs(moment.value) > std::abs(channel.peak->value)) channel.peak = moment;
  channel.has_bounds = channel.has_bounds || std::isfinite(moment.bound_90);
}

}  // namespace

std::vector<ChannelOfFrame> ChannelRecord::add(const wire::WireResult& result, double time_s) {
  ++frames_;
  const bool doubtful = is_doubtful(result);
  if (doubtful) ++doubtful_[reason_of(result)];
  std::vector<ChannelOfFrame> values;
  for (std::size_t c = 0; c < result.channels.size(); ++c) {
    const wire::WireChannel& channel = result.channels[c];
    const std::size_t place = place_of(channel, c);
    if (doubtful) continue;
    values.resize(std::max(values.size(), place + 1));
    values[place] = {channel, channel.end};
    add_moment(channels_[place], {channel, time_s});
  }
  return values;
}

std::uint64_t ChannelRecord::left_out() const noexcept {
  std::uint64_t frames = 0;
  for (const auto& [verdict, count] : doubtful_) frames += count;
  return frames;
}

std::size_t ChannelRecord::place_of(const wire::WireChannel& channel, std::size_t expected) {
  if (expected < channels_.size() && channels_[expected].name == channel.name) return expected;
  const auto found = std::ranges::find(channels_, channel.name, &TestChannel::name);
  const auto place = static_cast<std::size_t>(found - channels_.begin());
  if (found == channels_.end()) channels_.push_back({channel.name, channel.unit, {}, {}});
  return place;
}

}  // namespace lbea::tool
