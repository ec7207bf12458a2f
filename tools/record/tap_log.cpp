#include "tools/record/tap_log.hpp"

#include <spdlog/spdlog.h>

namespace lbea::tool {

void TapLog::look(TapEvents& events, std::vector<wire::WireSender> senders) {
  for (; const TapEvent* event = events.front(); events.release()) note(*event);
  wire::WireState state;
  state.senders = std::move(senders);
  frames_.note(state);
}

void TapLog::note(const TapEvent& event) {
  if (event.kind == TapEvent::Kind::received) return frames_.note(event.status, event.session, event.ids);
  if (refused_.may_speak(event.ids.count))
    spdlog::warn(
        "{}: refused: recorded, but not forwarded: the matcher is absent, does not know this program's key, or has no "
        "room{}",
        frames_text(event.ids), refused_.untold_text());
}

}  // namespace lbea::tool
