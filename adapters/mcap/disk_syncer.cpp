#include "adapters/mcap/disk_syncer.hpp"

namespace lbea::mcap {
namespace {

using namespace std::chrono_literals;

constexpr auto stop_interval = 20ms;  // how long a stop waits at most, beside the disk

}  // namespace

DiskSyncer::DiskSyncer(mcap::Sink& sink, std::chrono::milliseconds interval, DiskTally& disk)
    : sink_(sink), interval_(interval), disk_(disk) {
  if (interval_ > 0ms) thread_ = std::jthread([this](const std::stop_token& stopped) { run(stopped); });
}

void DiskSyncer::stop() noexcept {
  thread_.request_stop();
  if (thread_.joinable()) thread_.join();
}

void DiskSyncer::run(const std::stop_token& stopped) noexcept {
  std::uint64_t synced = 0;
  auto due = std::chrono::steady_clock::now() + interval_;
  while (!stopped.stop_requested()) {
    std::this_thread::sleep_for(stop_interval);
    if (std::chrono::steady_clock::now() < due || disk_.bytes == synced) continue;
    synced = disk_.bytes;
    if (const int error = sink_.sync(); error != 0) {
      disk_.last_error = error;
      ++disk_.failed_syncs;
    }
    due = std::chrono::steady_clock::now() + interval_;
  }
}

}  // namespace lbea::mcap
