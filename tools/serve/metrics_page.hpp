// What a monitoring agent reads about a running matcher.
#pragma once

#include "tools/serve/pipeline.hpp"

#include <string>

namespace lbea::tool {

/// In Prometheus's text format. Any thread.
[[nodiscard]] std::string metrics_page(const Pipeline& pipeline);

}  // namespace lbea::tool
