// What a recorder is to do, and what stands at the front of its file.
#pragma once

#include "adapters/mcap/compression.hpp"
#include "adapters/mcap/mcap_records.hpp"

#include <chrono>

namespace lbea::mcap {

/// Keeps only what happens around a trigger.
struct RecordWindow {
  std::chrono::nanoseconds before{0}, after{0};
};

struct RecorderConfig {
  std::size_t frame_ring_bytes = std::size_t{512} << 20;  // waits for the disk; 0.7 s of 62k points at 1,000/s
  std::size_t note_ring_bytes = std::size_t{8} << 20;     // the same for everything else
  std::size_t chunk_bytes = std::size_t{4} << 20;         // a chunk is closed when it has so much, ...
  std::chrono::milliseconds longest_wait{5};              // ... or when its first message has waited so long
  std::chrono::milliseconds sync_interval{1000};          // how often all is forced to the disk; 0: at the end
  std::chrono::milliseconds definitions_interval{1000};   // schemas and channels are repeated so often
  mcap::Compression compression = mcap::Compression::none;
  std::optional<RecordWindow> window;  // none: everything is recorded
};

/// What stands at the front of the file.
struct RecordingStart {
  mcap::Header header;
  std::vector<mcap::Schema> schemas;
  std::vector<mcap::Channel> channels;
  std::vector<mcap::Metadata> metadata;
  std::uint16_t status_channel = 0;  // one of `channels`: takes the recorder's own account, as JSON
};

}  // namespace lbea::mcap
