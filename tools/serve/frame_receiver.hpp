// The receiving thread: from the socket into the matcher's queue, or refused in words.
#pragma once

#include "adapters/wire/codec/codec.hpp"
#include "adapters/wire/sockets/streams.hpp"
#include "tools/serve/announcer.hpp"
#include "tools/serve/handover.hpp"
#include "tools/serve/sender_accounts.hpp"

#include <atomic>
#include <chrono>

namespace lbea::tool {

class FrameReceiver {
 public:
  FrameReceiver(const PipelineConfig& config, wire::FrameSource source, Handover& handover);
  /// Until stop(), and then until what has already arrived is taken in.
  void run() noexcept;
  // Any thread:
  void stop() noexcept { stopping_ = true; }
  [[nodiscard]] wire::PeerCounts peers() const noexcept { return source_.peers(); }
  [[nodiscard]] std::vector<wire::PeerVisit> visits() { return source_.visits(); }
  [[nodiscard]] std::uint64_t rounds() const noexcept { return rounds_.load(std::memory_order_relaxed); }

 private:
  using Clock = std::chrono::steady_clock;
  void drain() noexcept;
  void take(wire::Message message, bool patient) noexcept;
  bool take_control(wire::Message message, std::int64_t receive_ns) noexcept;
  void take_frame(wire::Message message, bool patient, std::int64_t receive_ns) noexcept;
  [[nodiscard]] wire::WireStatus note_id(wire::WireStatus status, std::int64_t receive_ns) noexcept;
  [[nodiscard]] FrameSlot* claim_slot(bool patient) noexcept;
  void accept(FrameSlot& slot, Clock::time_point begin, std::int64_t receive_ns) noexcept;

  wire::FrameSource source_;
  wire::FrameDecoder decoder_;
  Announcer announcer_;
  SenderAccounts accounts_;
  RunObserver* observer_;  // may be absent
  Handover& handover_;
  std::atomic<bool> stopping_{false};
  std::atomic<std::uint64_t> rounds_{0};
};

}  // namespace lbea::tool
