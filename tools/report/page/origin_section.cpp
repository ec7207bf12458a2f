// Files, versions and checksums; how to repeat the report and the match.
#include "tools/report/page/html.hpp"
#include "tools/report/page/page.hpp"

#include <nlohmann/json.hpp>

#include <algorithm>

namespace lbea::tool {
namespace {

class Pairs {
 public:
  /// `name`: without markup; `value`: any text.
  void add(const char* name, const std::string& value) {
    if (!value.empty())
      rows_ += std::string("<tr><th scope=\"row\">") + name + "</th><td>" + escaped(value) + "</td></tr>\n";
  }
  [[nodiscard]] std::string html() const { return "<table><tbody>" + rows_ + "</tbody></table>\n"; }

 private:
  std::string rows_;
};

/// The values at the top of the model's provenance, which a bake writes; those of another writer are shown as text.
std::string provenance_text(const Model& model) {
  const auto json = nlohmann::ordered_json::parse(model.provenance(), nullptr, false);
  if (!json.is_object()) return "";
  std::string text;
  for (const auto& [key, value] : json.items())
    if (value.is_string() || value.is_number())
      text += (text.empty() ? "" : "; ") + key + " " + (value.is_string() ? value.get<std::string>() : value.dump());
  return text;
}

std::string start_of(const TestReport& report) {
  return report.settings().start_ns > 0 ? date_text(report.settings().start_ns) : "";
}

/// lbea-replay needs the models of all components.
std::string commands_of(std::span<const TestReport> reports) {
  const TestReport& report = reports.front();
  const std::string recording = shell_word(report.content.file.string());
  std::string models;
  for (const TestReport& of : reports) models += " --model " + shell_word(of.model_file.string());
  std::string html = "<pre>" + escaped("lbea-inspect " + recording) + "\n";
  const bool has_all_models = reports.size() == std::max<std::size_t>(report.settings().components.size(), 1);
  if (report.content.audit.frames > 0 && has_all_models)
    html += escaped("lbea-replay " + recording + models + " --against") + "\n";
  return html + escaped("lbea-report " + recording + models + " -o report.html") + "\n</pre>\n";
}

}  // namespace

std::string origin_section(std::span<const TestReport> reports) {
  const TestReport& report = reports.front();
  const RunSettings& settings = report.settings();
  Pairs pairs;
  pairs.add("Recording", report.content.file.string());
  pairs.add("Its size and checksum", std::to_string(report.content.audit.file.bytes) + " bytes, XXH3-64 " +
                                         hexadecimal_text(report.content.checksum));
  pairs.add("Recorded by", settings.program);
  pairs.add("Recorded from", start_of(report));
  pairs.add("Method", settings.method);
  for (const TestReport& of : reports) {
    pairs.add("Model", of.model_file.string());
    pairs.add("Its checksum", hexadecimal_text(of.model.checksum()));
    pairs.add("Its origin", provenance_text(of.model));
  }
  pairs.add("Report by", "lbea-report " LBEA_VERSION_STRING);
  return "<section aria-label=\"Origin\"><h2>Origin and reproduction</h2>\n<div class=\"scroll values\" "
         "tabindex=\"0\">" +
         pairs.html() +
         "</div>\n<p>Check the recording, repeat the match with bit-identical results, repeat this report:</p>\n" +
         commands_of(reports) + "</section>\n";
}

}  // namespace lbea::tool
