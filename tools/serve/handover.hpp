// All that the receiving, the matching and the publishing thread share: bounded queues, each from one thread to one
// other, the bells beside them, and what each thread lets the next ones know.
#pragma once

#include "adapters/wire/codec/codec.hpp"
#include "adapters/wire/sockets/spsc_ring.hpp"
#include "tools/serve/pipeline_config.hpp"
#include "tools/shared/intake/shared_counters.hpp"
#include "tools/shared/matching/outcome.hpp"

#include <atomic>
#include <chrono>
#include <thread>
#include <vector>

namespace lbea::tool {

struct FrameSlot {
  wire::FrameHeader header;   // without what the message itself holds: frame_id, cloud
  std::vector<Point> points;  // max_points, of which header.points are filled
  std::int64_t receive_ns = 0;
  std::uint32_t decode_ns = 0;
  std::chrono::steady_clock::time_point queued;
};

struct Handover {
  /// Makes all the room that will be needed.
  explicit Handover(const PipelineConfig& config);

  wire::SpscRing<FrameSlot> frames;           // receiver to matcher
  wire::SpscRing<Outcome> outcomes;           // matcher to publisher
  wire::SpscRing<wire::WireResult> refusals;  // receiver to publisher: rejected and dropped frames
  wire::Doorbell frame_bell;                  // wakes the matcher
  wire::Doorbell result_bell;                 // wakes the publisher
  SharedCounters counters;
  SharedSenders senders;                                        // receiver to publisher
  std::atomic<bool> receiver_done{false}, matcher_done{false};  // everything has been handed on
  std::atomic<bool> state_wanted{false};                        // soon, for who comes or goes
};

/// A bell that was missed costs at most this.
inline constexpr std::chrono::milliseconds longest_idle{100};

/// Producer: the next free slot, however long it takes.
template <class T>
[[nodiscard]] T& wait_for_slot(wire::SpscRing<T>& ring) noexcept {
  constexpr std::chrono::microseconds between_looks{100};
  T* slot = ring.claim();
  while (slot == nullptr) {
    std::this_thread::sleep_for(between_looks);
    slot = ring.claim();
  }
  return *slot;
}

}  // namespace lbea::tool
