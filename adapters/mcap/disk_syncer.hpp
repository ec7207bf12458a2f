// Forces a recording to the disk now and then, on a thread of its own: the disk may take its time, and what is recorded
// meanwhile must not wait for it.
#pragma once

#include "adapters/mcap/disk_tally.hpp"
#include "adapters/mcap/sink.hpp"

#include <chrono>
#include <thread>

namespace lbea::mcap {

class DiskSyncer {
 public:
  /// Begins, unless `interval` is 0. What is passed in outlives it. Throws std::system_error.
  DiskSyncer(mcap::Sink& sink, std::chrono::milliseconds interval, DiskTally& disk);
  /// Waits for a sync that goes on. At the latest done by the destructor.
  void stop() noexcept;

 private:
  void run(const std::stop_token& stopped) noexcept;
  mcap::Sink& sink_;
  std::chrono::milliseconds interval_;
  DiskTally& disk_;
  std::jthread thread_;
};

}  // namespace lbea::mcap
