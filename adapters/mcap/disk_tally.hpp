// What the disk did so far. The writing and the syncing thread count here, anybody may read.
#pragma once

#include <atomic>
#include <cstdint>

namespace lbea::mcap {

struct DiskTally {
  std::atomic<std::uint64_t> bytes{0};  // in the file
  std::atomic<std::uint64_t> failed_syncs{0};
  std::atomic<std::int64_t> longest_write_ns{0};
  std::atomic<int> last_error{0};  // the system's number
};

}  // namespace lbea::mcap
