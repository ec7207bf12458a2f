#include "tools/eval/channels/channel_columns.hpp"

#include "tools/shared/text/channel_column.hpp"

#include <algorithm>
#include <limits>

namespace lbea::tool {

ChannelColumns::ChannelColumns(const std::vector<LiveRow>& rows) {
  for (const LiveRow& row : rows)
    for (const wire::WireChannel& channel : row.result.channels)
      if (std::ranges::find(channels_, channel.name, &wire::WireChannel::name) == channels_.end())
        channels_.push_back(channel);
}

std::vector<std::string> ChannelColumns::heads() const {
  std::vector<std::string> heads;
  for (const wire::WireChannel& channel : channels_)
    for (const char* kind : {"", "bound_90"}) heads.push_back(channel_column(channel.name, kind, channel.unit));
  return heads;
}

std::vector<float> ChannelColumns::cells(const wire::WireResult& result) const {
  std::vector<float> cells(2 * channels_.size(), std::numeric_limits<float>::quiet_NaN());
  for (std::size_t c = 0; c < channels_.size(); ++c) {
    const auto found = std::ranges::find(result.channels, channels_[c].name, &wire::WireChannel::name);
    if (found == result.channels.end()) continue;
    cells[2 * c] = found->value;
    cells[2 * c + 1] = found->bound_90;
  }
  return cells;
}

}  // namespace lbea::tool
