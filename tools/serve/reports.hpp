// What lbea-serve reports about a run: the closing tally and the metrics page.
#pragma once

#include "tools/serve/pipeline/pipeline.hpp"

namespace lbea::tool {

/// "captured 10 = matched 7 + rejected 2 (damaged 2) + dropped 1 (queue_full 1); received 10, ..."
/// `rigs`: a further line for each of several.
[[nodiscard]] std::string tally_line(const wire::Counters& counters, std::span<const wire::WireRig> rigs = {});
/// The same as one JSON object; with several rigs "rigs" has one for each name.
[[nodiscard]] std::string tally_json(const wire::Counters& counters, std::span<const wire::WireRig> rigs = {});
/// The counters add up, nothing was dropped or missed, every sender said goodbye, no two senders alternated, and the
/// recording, if any, is complete.
[[nodiscard]] bool is_complete(const wire::Counters& counters);

/// The metrics of a running matcher in Prometheus's text format. Any thread.
[[nodiscard]] std::string metrics_page(const Pipeline& pipeline);

}  // namespace lbea::tool
