// At the end of a run: who had not said goodbye.
#pragma once

#include "adapters/wire/codec/messages.hpp"

#include <spdlog/spdlog.h>

#include <vector>

namespace lbea::tool {

/// Logs a line for each: what it sent last may not have come.
inline void warn_of_unfinished(const std::vector<wire::WireSender>& senders) {
  for (const wire::WireSender& sender : senders)
    if (sender.condition != wire::SenderCondition::ended && sender.next_id > sender.first_id)
      spdlog::warn(
          "session {:016x} did not say goodbye: its captures are accounted for up to id {}; whether it took more is "
          "unknown",
          sender.session, sender.next_id - 1);
}

}  // namespace lbea::tool
