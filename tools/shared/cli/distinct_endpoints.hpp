// Refuses two options with the same endpoint, before the second bind fails with a less clear error.
#pragma once

#include <initializer_list>
#include <string>
#include <utility>

namespace lbea::tool {

/// Options by name with their addresses, empty when not given. Throws WrongUsage that names the first two that are the
/// same; "any free port" is never the same.
void require_distinct_endpoints(std::initializer_list<std::pair<const char*, std::string>> options);

}  // namespace lbea::tool
