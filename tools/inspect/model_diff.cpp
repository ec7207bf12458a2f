#include "tools/inspect/model_diff.hpp"

#include "tools/inspect/json_words.hpp"
#include "tools/inspect/model_report.hpp"

#include <cstdio>
#include <map>
#include <string>
#include <vector>

namespace lbea::tool {
namespace {

using Json = nlohmann::ordered_json;

/// A report's list of objects by the name that `key` makes of each.
std::map<std::string, Json> by_name(const Json& list, const auto& key) {
  std::map<std::string, Json> result;
  for (const Json& item : list) result.emplace(key(item), item);
  return result;
}

/// Each run with all that is known of it: samples, parameters, the hashes of its files.
std::map<std::string, Json> runs_of(const Json& report) {
  auto runs = by_name(report["simulations"], [](const Json& run) { return run["name"].get<std::string>(); });
  if (report["provenance"].is_object() && report["provenance"].contains("inputs"))
    for (const Json& input : report["provenance"]["inputs"])
      if (const auto run = runs.find(input.value("name", "")); run != runs.end()) run->second["files"] = input["files"];
  return runs;
}

std::map<std::string, Json> sections_of(const Json& report) {
  auto sections = by_name(report["sections"], [](const Json& section) {
    return section["title"].get<std::string>() + " " + text(section["part"]);
  });
  for (auto& [name, section] : sections) section.erase("offset");  // moves with the sections before it
  return sections;
}

Json settings_of(const Json& report) {
  Json settings = report["sizes"];
  if (!report["provenance"].is_object()) return settings;
  for (const auto& [key, value] : report["provenance"].items())
    if (key != "inputs") settings[key] = value;
  return settings;
}

Json changes_of_settings(const Json& before, const Json& after) {
  Json changes = Json::object();
  for (const auto& [key, value] : before.items())
    if (!after.contains(key) || after[key] != value)
      changes[key] = {{"before", value}, {"after", after.value(key, Json())}};
  for (const auto& [key, value] : after.items())
    if (!before.contains(key)) changes[key] = {{"before", Json()}, {"after", value}};
  return changes;
}

/// Names that are new, gone, and there with another content.
Json changes_of(const std::map<std::string, Json>& before, const std::map<std::string, Json>& after) {
  Json added = Json::array(), withdrawn = Json::array(), changed = Json::array();
  for (const auto& [name, value] : after)
    if (!before.contains(name)) added.push_back(name);
  for (const auto& [name, value] : before) {
    const auto other = after.find(name);
    if (other == after.end())
      withdrawn.push_back(name);
    else if (other->second != value)
      changed.push_back(name);
  }
  return {{"added", added}, {"withdrawn", withdrawn}, {"changed", changed}};
}

Json diff(const std::filesystem::path& before, const std::filesystem::path& after) {
  const Json first = model_report(before), second = model_report(after);
  Json result{{"before", before.string()}, {"after", after.string()}};
  result["runs"] = changes_of(runs_of(first), runs_of(second));
  result["settings"] = changes_of_settings(settings_of(first), settings_of(second));
  result["sections"] = changes_of(sections_of(first), sections_of(second));
  bool is_same = result["settings"].empty();
  for (const char* what : {"runs", "sections"})
    for (const Json& names : result[what]) is_same = is_same && names.empty();
  result["same"] = is_same;
  return result;
}

void print_names(const char* what, const Json& changes) {
  for (const auto& [kind, names] : changes.items())
    for (const Json& name : names) std::printf("%-8s %-9s  %s\n", what, kind.c_str(), text(name).c_str());
}

}  // namespace

void print_diff(const std::filesystem::path& before, const std::filesystem::path& after) {
  const Json changes = diff(before, after);
  if (changes["same"].get<bool>()) {
    std::printf("%s and %s hold the same\n", before.c_str(), after.c_str());
    return;
  }
  print_names("run", changes["runs"]);
  for (const auto& [key, change] : changes["settings"].items())
    std::printf("%-8s %-9s  %s: %s -> %s\n", "setting", "changed", key.c_str(), text(change["before"]).c_str(),
                text(change["after"]).c_str());
  print_names("section", changes["sections"]);
}

void print_diff_json(const std::filesystem::path& before, const std::filesystem::path& after) {
  std::printf("%s\n", diff(before, after).dump(2, ' ', false, Json::error_handler_t::replace).c_str());
}

}  // namespace lbea::tool
