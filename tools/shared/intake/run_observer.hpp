// What the pipeline shows of a run to who writes it down.
#pragma once

#include "adapters/wire/codec/codec.hpp"
#include "adapters/wire/sockets/streams.hpp"

namespace lbea::tool {

class RunObserver {
 public:
  struct Counts {
    std::uint64_t recorded = 0;    // frames in the file
    std::uint64_t unrecorded = 0;  // frames and results that should be there and are not
  };
  virtual ~RunObserver() = default;
  /// Receiving thread. Every message as it came, whatever becomes of it; `message` is valid during the call.
  virtual void frame(wire::Message message, const wire::FrameHeader& header, std::int64_t receive_ns) noexcept = 0;
  /// Publishing thread. What was published, and the same in bytes.
  virtual void result(wire::Message message, const wire::WireResult& result) noexcept = 0;
  virtual void state(wire::Message message, const wire::WireState& state) noexcept = 0;
  /// Any thread.
  [[nodiscard]] virtual Counts counts() const noexcept = 0;
  /// Any thread. The file it writes, if it does.
  [[nodiscard]] virtual std::optional<wire::WireRecording> recording() const noexcept { return {}; }
};

}  // namespace lbea::tool
