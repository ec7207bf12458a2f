// What the operator reads while frames come in: as lbea-serve says it, from a thread that may wait for the terminal.
#pragma once

#include "adapters/wire/sockets/spsc_ring.hpp"
#include "tools/shared/cli/log_line.hpp"
#include "tools/shared/intake/frame_log.hpp"

namespace lbea::tool {

/// Something to tell of some captures.
struct TapEvent {
  enum class Kind : std::uint8_t { received, refused };  // refused: the matcher had no room for a frame
  Kind kind = Kind::received;
  wire::WireStatus status = wire::WireStatus::ok;
  std::uint64_t session = 0;
  IdRange ids;
};
/// From the receiving thread; what finds no room is in the tally alone.
using TapEvents = wire::SpscRing<TapEvent>;

class TapLog {
 public:
  /// Every now and then.
  void look(TapEvents& events, std::vector<wire::WireSender> senders);

 private:
  void note(const TapEvent& event);
  FrameLog frames_;
  LogLine refused_;
};

}  // namespace lbea::tool
