// The closing account of a run of lbea-serve.
#pragma once

#include "adapters/wire/codec/messages.hpp"

#include <string>

namespace lbea::tool {

/// "captured 10 = matched 7 + rejected 2 (damaged 2) + dropped 1 (queue_full 1); received 10, ..."
[[nodiscard]] std::string tally_line(const wire::Counters& counters);
/// The same as one JSON object.
[[nodiscard]] std::string tally_json(const wire::Counters& counters);
/// Every capture was answered: the account adds up, nothing was dropped or missed, every sender said goodbye, and what
/// was to be recorded is.
[[nodiscard]] bool is_complete(const wire::Counters& counters);

}  // namespace lbea::tool
