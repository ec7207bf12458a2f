// Tables of the forecasts of an evaluation.
#pragma once

#include "tools/eval/evaluation.hpp"

namespace lbea::tool {

/// Forecasts of experiments that are not in the ensemble, at shares of the tests' duration.
[[nodiscard]] std::string forecast_tables(const Evaluation& evaluation);

}  // namespace lbea::tool
