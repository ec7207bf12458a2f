// The closing account of a run of lbea-serve.
#pragma once

#include "adapters/wire/codec/messages.hpp"

#include <string>

namespace lbea {

/// "captured 10 = matched 7 + rejected 2 (damaged 2) + dropped 1 (queue_full 1); received 10, ..."
[[nodiscard]] std::string tally_line(const Counters& counters);
/// The same as one JSON object.
[[nodiscard]] std::string tally_json(const Counters& counters);
/// Every capture was answered: the account adds up, nothing was dropped or missed, every sender said goodbye, and what
/// was to be recorded is.
[[nodiscard]] bool is_complete(const Counters& counters);

}  // namespace lbea
