#include "tools/report/page/page.hpp"

#include "tools/report/page/html.hpp"
#include "tools/report/page/style.hpp"
#include "tools/shared/text/formatted.hpp"

#include <algorithm>
#include <cmath>
#include <ctime>

namespace lbea::tool {
namespace {

// Nothing is loaded and no script runs, whatever a recording contains.
constexpr std::string_view policy = "default-src 'none'; style-src 'unsafe-inline'; img-src data:";

std::string head_of(const TestReport& report) {
  const std::string name = escaped(report.content.file.filename().string());
  return "<!doctype html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n"
         "<meta http-equiv=\"Content-Security-Policy\" content=\"" +
         std::string(policy) +
         "\">\n<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n<title>" + name +
         ": report of the test</title>\n<style>\n" + std::string(style) + "</style>\n</head>\n<body>\n<main>\n";
}

std::string models_text(std::span<const TestReport> reports) {
  std::string text;
  for (const TestReport& report : reports)
    text += (text.empty() ? "" : ", ") +
            (report.component.empty() ? "" : "Component " + escaped(report.component) + ": model ") +
            "<span class=\"name\">" + escaped(report.model_file.filename().string()) + "</span> with " +
            std::to_string(report.model.simulations()) + " simulations";
  return (reports.front().component.empty() ? "Model " : "") + text;
}

/// Recorded, but their models were not given.
std::string left_out_text(std::span<const TestReport> reports) {
  std::string names;
  for (const ComponentSettings& recorded : reports.front().settings().components)
    if (std::ranges::find(reports, recorded.name, &TestReport::component) == reports.end())
      names += (names.empty() ? "" : ", ") + escaped(recorded.name);
  return names.empty() ? "" : " Not in this report: component " + names + ".";
}

std::string title_of(std::span<const TestReport> reports) {
  const TestReport& report = reports.front();
  std::string title = "<header><h1>Report of the test <span class=\"name\">" +
                      escaped(report.content.file.filename().string()) + "</span></h1>\n<p>";
  title += report.settings().program.empty() ? "Recorded" : "Recorded by " + escaped(report.settings().program);
  if (report.settings().start_ns > 0) title += ", from " + date_text(report.settings().start_ns) + " on";
  title += ". " + models_text(reports) + "." + left_out_text(reports) + "</p>";
  if (report.is_own_match)
    title +=
        "<p>The recording contains no results: its frames were matched for this report, with the recorded settings "
        "where "
        "it has them.</p>";
  return title + "</header>\n";
}

/// All sections but those that are of the whole recording.
std::string sections_of(const TestReport& report) {
  std::string html;
  for (const auto section :
       {answer_section, end_section, tests_section, pictures_section, forecast_section, parameters_section,
        channels_section, fields_section, curves_section, simulations_section, regions_section})
    html += section(report);
  return html;
}

/// The sections of several components have different names.
std::string named(std::string html, const std::string& name) {
  constexpr std::string_view label = "aria-label=\"";
  for (std::size_t at = html.find("<section"); at != html.npos; at = html.find("<section", at + 1))
    html.insert(html.find(label, at) + label.size(), name + ": ");
  return html;
}

std::string article_of(const TestReport& report) {
  const std::string name = escaped(report.component);
  return "<article aria-label=\"" + name + "\"><h1>Component " + name + "</h1>\n" + named(sections_of(report), name) +
         "</article>\n";
}

}  // namespace

std::string page_of(std::span<const TestReport> reports) {
  std::string page = head_of(reports.front()) + title_of(reports) + flaws_section(reports.front());
  if (reports.size() == 1) {
    page += sections_of(reports.front());
  } else {
    page += joint_section(reports);
    for (const TestReport& report : reports) page += article_of(report);
  }
  return page + accounts_section(reports) + origin_section(reports) + "</main>\n</body>\n</html>\n";
}

std::string range_text(const Model& model, std::uint32_t parameter) {
  double low = std::numeric_limits<double>::infinity(), high = -low;
  for (std::uint32_t run = 0; run < model.simulations(); ++run)
    if (const double value = model.parameter(run, parameter); std::isfinite(value)) {
      low = std::min(low, value);
      high = std::max(high, value);
    }
  return number_text(low) + " to " + number_text(high);
}

std::string time_text(double seconds) { return number_text(seconds * 1e3) + " ms"; }

std::string date_text(std::int64_t ns_since_1970) {
  const std::time_t seconds = ns_since_1970 / 1'000'000'000;
  std::tm utc{};
  std::array<char, 64> text{};
  if (::gmtime_r(&seconds, &utc) == nullptr) return "an unknown time";
  return std::strftime(text.data(), text.size(), "%Y-%m-%d %H:%M:%S UTC", &utc) > 0 ? text.data() : "an unknown time";
}

std::string hexadecimal_text(std::uint64_t number) {
  return formatted("%016llx", static_cast<unsigned long long>(number));
}

}  // namespace lbea::tool
