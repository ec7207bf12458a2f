// What the pipeline passes to observers of a run: recorder, preview, inference.
#pragma once

#include "adapters/wire/codec/codec.hpp"
#include "adapters/wire/sockets/streams.hpp"

namespace lbea::tool {

/// A rig's stamp by the clock that all rigs have in common. Wraps around.
[[nodiscard]] inline std::int64_t common_stamp_ns(std::int64_t stamp_ns, std::int64_t clock_offset_ns) noexcept {
  return static_cast<std::int64_t>(static_cast<std::uint64_t>(stamp_ns) + static_cast<std::uint64_t>(clock_offset_ns));
}

/// When a frame was received, and from which of several rigs.
struct Arrival {
  std::int64_t receive_ns = 0;
  std::uint32_t rig = 0;
};

class RunObserver {
 public:
  struct Counts {
    std::uint64_t recorded = 0;    // frames in the file
    std::uint64_t unrecorded = 0;  // frames and results that are missing from the file
  };
  virtual ~RunObserver() = default;
  /// A frame of the running test, captured at `stamp_ns` of the rigs' common clock. With one rig: receiving thread,
  /// before frame(); it may still find no room. With several: matching thread.
  virtual void frame_of_test(std::int64_t /*stamp_ns*/, std::int64_t /*receive_ns*/) noexcept {}
  /// Receiving thread. Every message as received, whatever its status; it is valid during the call.
  virtual void frame(wire::Message, const wire::FrameHeader&, const Arrival&) noexcept {}
  /// Publishing thread. A published message, encoded and decoded.
  virtual void result(wire::Message, const wire::WireResult&) noexcept {}
  virtual void state(wire::Message, const wire::WireState&) noexcept {}
  /// Any thread.
  [[nodiscard]] virtual Counts counts() const noexcept { return {}; }
  /// Any thread. The state of the recording, if this observer records.
  [[nodiscard]] virtual std::optional<wire::WireRecording> recording() const noexcept { return {}; }
};

/// Several observers as one.
class RunObservers final : public RunObserver {
 public:
  /// Call before the pipeline starts; null is ignored.
  void add(RunObserver* observer) {
    if (observer != nullptr) observers_.push_back(observer);
  }
  void frame_of_test(std::int64_t stamp_ns, std::int64_t receive_ns) noexcept override {
    for (RunObserver* observer : observers_) observer->frame_of_test(stamp_ns, receive_ns);
  }
  void frame(wire::Message message, const wire::FrameHeader& header, const Arrival& arrival) noexcept override {
    for (RunObserver* observer : observers_) observer->frame(message, header, arrival);
  }
  void result(wire::Message message, const wire::WireResult& result) noexcept override {
    for (RunObserver* observer : observers_) observer->result(message, result);
  }
  void state(wire::Message message, const wire::WireState& state) noexcept override {
    for (RunObserver* observer : observers_) observer->state(message, state);
  }
  [[nodiscard]] Counts counts() const noexcept override {
    Counts sum;
    for (const RunObserver* observer : observers_) {
      sum.recorded += observer->counts().recorded;
      sum.unrecorded += observer->counts().unrecorded;
    }
    return sum;
  }
  [[nodiscard]] std::optional<wire::WireRecording> recording() const noexcept override {
    for (const RunObserver* observer : observers_)
      if (auto found = observer->recording()) return found;
    return {};
  }

 private:
  std::vector<RunObserver*> observers_;
};

}  // namespace lbea::tool
