// Results for a recording that has none, because it was made without a matcher.
#pragma once

#include "tools/report/content/test_report.hpp"

namespace lbea::tool {

/// Matches all frames as lbea-replay --model does, and fills `report` as if the results were recorded. Throws Error for
/// a damaged recording, or when stopped.
void match_frames(TestReport& report, const ReportOptions& options, const ReadingProgress& progress);

}  // namespace lbea::tool
