#include "tools/shared/intake/rig_options.hpp"

#include "adapters/wire/codec/messages.hpp"
#include "tools/shared/cli/tool.hpp"

#include <algorithm>

namespace lbea::tool {
namespace {

constexpr std::size_t longest_name = 32;

}  // namespace

std::pair<std::string, std::string> divide_rig_option(const std::string& text) {
  constexpr std::string_view of_names = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789_-";
  const std::size_t at = text.find_first_not_of(of_names);
  if (at == 0 || at == std::string::npos || text[at] != '=') return {{}, text};
  return {text.substr(0, at), text.substr(at + 1)};
}

std::vector<RigEndpoint> read_rig_endpoints(const std::vector<std::string>& texts) {
  std::vector<RigEndpoint> rigs;
  if (texts.size() > wire::most_rigs)
    throw WrongUsage("--frames: give at most " + std::to_string(wire::most_rigs) + " rigs");
  for (const std::string& text : texts) {
    const auto [name, endpoint] = divide_rig_option(text);
    if ((name.empty() && texts.size() > 1) || name.size() > longest_name || endpoint.empty())
      throw WrongUsage("--frames " + text + ": with several rigs, give NAME=ENDPOINT; names have up to " +
                       std::to_string(longest_name) + " letters, digits, _ and -");
    if (std::ranges::find(rigs, name, &RigEndpoint::name) != rigs.end())
      throw WrongUsage("--frames: the name " + name + " is given to two rigs");
    rigs.push_back({name, endpoint});
  }
  return rigs;
}

std::vector<std::optional<std::string>> values_per_rig(const std::vector<std::string>& rigs, const PerRigOption& option,
                                                       const std::vector<std::string>& texts) {
  std::vector<std::optional<std::string>> values(rigs.size());
  for (const std::string& text : texts) {
    const bool is_alone = rigs.size() == 1 && rigs.front().empty();
    const auto [name, value] = is_alone ? std::pair(std::string(), text) : divide_rig_option(text);
    auto rig = std::ranges::find(rigs, name);
    if (rigs.size() == 1 && name.empty()) rig = rigs.begin();
    if (rig == rigs.end())
      throw WrongUsage(option.name + " " + text + ": give " + option.name + " NAME=" + option.value +
                       " with the name of " + option.names_from);
    auto& of_rig = values[static_cast<std::size_t>(rig - rigs.begin())];
    if (of_rig) throw WrongUsage(option.name + " is given twice" + (name.empty() ? "" : " for " + name));
    of_rig = value;
  }
  return values;
}

}  // namespace lbea::tool
