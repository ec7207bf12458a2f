// Columns of channels in tables of frames.
#pragma once

#include "tools/eval/live.hpp"

#include <string>
#include <vector>

namespace lbea::tool {

/// The channels of all frames, in the order in which they first appear; names are unique.
class ChannelColumns {
 public:
  explicit ChannelColumns(const std::vector<LiveRow>& rows);
  /// Two per channel: its value, and its 90 % bound.
  [[nodiscard]] std::vector<std::string> heads() const;
  /// One per column; NaN where the frame does not have the channel.
  [[nodiscard]] std::vector<float> cells(const wire::WireResult& result) const;

 private:
  std::vector<wire::WireChannel> channels_;
};

}  // namespace lbea::tool
