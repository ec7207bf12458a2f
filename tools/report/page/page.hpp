// The report as one HTML page without external files and scripts, and as JSON.
#pragma once

#include "tools/report/content/test_report.hpp"

#include <string>

namespace lbea::tool {

/// reports: one, or one for each component.
[[nodiscard]] std::string page_of(std::span<const TestReport> reports);
/// The same facts for programs.
[[nodiscard]] std::string summary_json(std::span<const TestReport> reports);

// The sections, in the order of the page. Empty when there is nothing to show.
[[nodiscard]] std::string flaws_section(const TestReport& report);
[[nodiscard]] std::string joint_section(std::span<const TestReport> components);
[[nodiscard]] std::string answer_section(const TestReport& report);
[[nodiscard]] std::string end_section(const TestReport& report);
[[nodiscard]] std::string tests_section(const TestReport& report);
[[nodiscard]] std::string pictures_section(const TestReport& report);
[[nodiscard]] std::string forecast_section(const TestReport& report);
[[nodiscard]] std::string parameters_section(const TestReport& report);
[[nodiscard]] std::string channels_section(const TestReport& report);
[[nodiscard]] std::string fields_section(const TestReport& report);
[[nodiscard]] std::string curves_section(const TestReport& report);
[[nodiscard]] std::string simulations_section(const TestReport& report);
[[nodiscard]] std::string regions_section(const TestReport& report);
[[nodiscard]] std::string accounts_section(std::span<const TestReport> reports);
[[nodiscard]] std::string origin_section(std::span<const TestReport> reports);

/// "7.5 to 12.3": the lowest and the highest value of the simulations.
[[nodiscard]] std::string range_text(const Model& model, std::uint32_t parameter);
/// "12.5 ms" since the first frame of the test.
[[nodiscard]] std::string time_text(double seconds);
/// UTC.
[[nodiscard]] std::string date_text(std::int64_t ns_since_1970);
/// 16 hexadecimal digits.
[[nodiscard]] std::string hexadecimal_text(std::uint64_t number);

}  // namespace lbea::tool
