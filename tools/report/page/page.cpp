#include "tools/report/page/page.hpp"

#include "tools/report/page/html.hpp"
#include "tools/report/page/style.hpp"
#include "tools/shared/cli/formatted.hpp"

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

std::string title_of(const TestReport& report) {
  std::string title = "<header><h1>Report of the test <span class=\"name\">" +
                      escaped(report.content.file.filename().string()) + "</span></h1>\n<p>";
  title += report.settings().program.empty() ? "Recorded" : "Recorded by " + escaped(report.settings().program);
  if (report.settings().start_ns > 0) title += ", from " + date_text(report.settings().start_ns) + " on";
  title += ". Model <span class=\"name\">" + escaped(report.model_file.filename().string()) + "</span> with " +
           std::to_string(report.model.simulations()) + " simulations.</p>";
  if (report.is_own_match)
    title +=
        "<p>The recording contains no results: its frames were matched for this report, with the recorded settings "
        "where "
        "it has them.</p>";
  return title + "</header>\n";
}

}  // namespace

std::string page_of(const TestReport& report) {
  std::string page = head_of(report) + title_of(report);
  for (const auto section : {answer_section, end_section, tests_section, pictures_section, forecast_section,
                             parameters_section, channels_section, fields_section, curves_section, simulations_section,
                             regions_section, accounts_section, origin_section})
    page += section(report);
  return page + "</main>\n</body>\n</html>\n";
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
