#include "tools/serve/preflight.hpp"

#include <nlohmann/json.hpp>

#include <algorithm>
#include <array>

namespace lbea::tool {
namespace {

std::string name_of(Finding::Level level) {
  constexpr std::array<const char*, 3> names{"ok", "warning", "failed"};
  return names[static_cast<std::size_t>(level)];
}

}  // namespace

void Preflight::ask(const std::string& name, const std::function<std::string()>& question) {
  Finding finding{name, Finding::Level::ok, {}};
  try {
    finding.text = question();
  } catch (const std::exception& error) {
    finding.level = Finding::Level::failed;
    finding.text = error.what();
  }
  note(std::move(finding));
}

bool Preflight::passed() const noexcept {
  return std::none_of(findings_.begin(), findings_.end(),
                      [](const Finding& finding) { return finding.level == Finding::Level::failed; });
}

std::string Preflight::to_text() const {
  std::string text;
  for (const Finding& finding : findings_) {
    std::string level = name_of(finding.level), name = finding.name;
    level.resize(8, ' ');
    name.resize(std::max<std::size_t>(name.size(), 12), ' ');
    text += level + name + " " + finding.text + "\n";
  }
  return text + (passed() ? "ready for the test" : "not ready: see what failed");
}

std::string Preflight::to_json() const {
  nlohmann::ordered_json json = nlohmann::ordered_json::object();
  json["passed"] = passed();
  json["findings"] = nlohmann::ordered_json::array();
  for (const Finding& finding : findings_)
    json["findings"].push_back({{"name", finding.name}, {"level", name_of(finding.level)}, {"text", finding.text}});
  return json.dump(-1, ' ', false, nlohmann::ordered_json::error_handler_t::replace);
}

}  // namespace lbea::tool
