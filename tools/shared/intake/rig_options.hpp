// Options that several rigs have, NAME=VALUE for each.
#pragma once

#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace lbea::tool {

/// NAME and VALUE of "NAME=VALUE"; without a name the whole text is the value.
[[nodiscard]] std::pair<std::string, std::string> divide_rig_option(const std::string& text);

struct RigEndpoint {
  std::string name, endpoint;  // one rig may have no name
};
/// Of --frames. Throws WrongUsage unless there is one rig, or each of several has its own name, and an endpoint.
[[nodiscard]] std::vector<RigEndpoint> read_rig_endpoints(const std::vector<std::string>& texts);

/// The name of an option, what its values are, and where its rigs' names come from.
struct PerRigOption {
  std::string name, value, names_from = "a rig of --frames";
};
/// The option's value for each of these rigs; nothing where it has none. A single rig needs no name. Throws WrongUsage
/// for other names, and for two values.
[[nodiscard]] std::vector<std::optional<std::string>> values_per_rig(const std::vector<std::string>& rigs,
                                                                     const PerRigOption& option,
                                                                     const std::vector<std::string>& texts);

}  // namespace lbea::tool
