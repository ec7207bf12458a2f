#include "tools/shared/cli/distinct_endpoints.hpp"

#include "tools/shared/cli/tool.hpp"

#include <map>

namespace lbea::tool {

void require_distinct_endpoints(std::initializer_list<std::pair<const char*, std::string>> options) {
  std::map<std::string, const char*> owners;
  for (const auto& [name, address] : options) {
    if (address.empty() || address.ends_with(":*")) continue;
    const auto [owner, is_new] = owners.emplace(address, name);
    if (!is_new)
      throw WrongUsage(std::string(owner->second) + " and " + name + " are both \"" + address +
                       "\"; give each an endpoint of its own");
  }
}

}  // namespace lbea::tool
