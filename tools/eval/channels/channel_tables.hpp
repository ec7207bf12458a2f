// Tables of the channels of an evaluation.
#pragma once

#include "tools/eval/evaluation.hpp"

namespace lbea::tool {

/// Per channel: errors and intervals in the frames of experiments that are not in the ensemble. Empty without channels.
[[nodiscard]] std::string channel_tables(const Evaluation& evaluation);

}  // namespace lbea::tool
