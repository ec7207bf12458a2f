// The quantities of interest of the latest matched frame, for threads that report them.
#pragma once

#include "adapters/wire/codec/messages.hpp"

#include <mutex>

namespace lbea::tool {

class LatestChannels {
 public:
  struct Frame {
    std::uint64_t session = 0;
    std::vector<wire::WireChannel> channels;
  };
  /// A matched frame replaces the channels, a doubtful one by none. The end of its sender's stream removes them. One
  /// thread.
  void add(const wire::WireResult& result);
  /// Any thread.
  [[nodiscard]] Frame load() const;

 private:
  mutable std::mutex mutex_;
  Frame latest_;
};

}  // namespace lbea::tool
