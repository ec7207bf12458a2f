// Tables of the forecasts of an evaluation.
#pragma once

#include "tools/eval/evaluation.hpp"

namespace lbea::tool {

/// Forecasts at shares of the tests' duration. Empty without forecasts.
[[nodiscard]] std::string forecast_tables(const Round& round, const Model& model, std::string_view length_unit);

}  // namespace lbea::tool
