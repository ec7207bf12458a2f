// What a replay prints.
#pragma once

#include "tools/replay/comparison.hpp"
#include "tools/replay/socket_replay.hpp"

#include <string>

namespace lbea::tool {

[[nodiscard]] std::string result_header();
/// One line of a table, or one JSON object.
[[nodiscard]] std::string result_line(const wire::WireResult& result);
[[nodiscard]] std::string result_json(const wire::WireResult& result);

[[nodiscard]] std::string comparison_line(const ComparisonTally& tally);
[[nodiscard]] std::string comparison_json(const ComparisonTally& tally);

[[nodiscard]] std::string socket_line(const SocketReplayTally& tally, double worst_lateness_ms);
[[nodiscard]] std::string socket_json(const SocketReplayTally& tally, double worst_lateness_ms);

}  // namespace lbea::tool
