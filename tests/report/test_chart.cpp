// Curves of the report: gaps, bands, long tests; numbers as text.
#include "tools/report/page/chart.hpp"
#include "tools/report/page/html.hpp"

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <sstream>

using namespace lbea::tool;

namespace {

constexpr double unknown = std::numeric_limits<double>::quiet_NaN(), infinity = std::numeric_limits<double>::infinity();

/// The paths of a class, or all with the empty one.
std::vector<std::string> paths_in(const std::string& svg, const std::string& with) {
  std::vector<std::string> paths;
  for (std::size_t at = svg.find("<path"); at != svg.npos; at = svg.find("<path", at + 1)) {
    const std::string tag = svg.substr(at, svg.find('>', at) - at);
    if (tag.find(with) == tag.npos || tag.find("d=\"M1 ") != tag.npos) continue;  // not those of the legend
    const std::size_t begin = tag.find(" d=\"") + 4;
    paths.push_back(tag.substr(begin, tag.find('"', begin) - begin));
  }
  return paths;
}

std::size_t count_of(const std::string& text, char c) { return static_cast<std::size_t>(std::ranges::count(text, c)); }

Chart chart_of(std::vector<double> values) {
  Chart chart;
  chart.title = "a < b";
  for (std::size_t i = 0; i < values.size(); ++i) chart.abscissas.push_back(static_cast<double>(i));
  chart.curves = {{"curve", std::move(values)}};
  return chart;
}

/// Vertical coordinates of a path of absolute M and L.
std::vector<double> heights_in(const std::string& path) {
  std::vector<double> heights;
  std::string spaced = path;
  for (char& c : spaced)
    if (std::string_view("MLZh").find(c) != std::string_view::npos) c = ' ';
  std::istringstream numbers(spaced);
  for (double x = 0, y = 0; numbers >> x >> y;) heights.push_back(y);
  return heights;
}

}  // namespace

TEST_CASE("unknown values leave gaps, and no coordinate is not a number") {
  const Chart chart = chart_of({unknown, 1, 2, unknown, 3, infinity, 4, 5, -infinity});
  const std::string svg = figure_of(chart);
  const auto curves = paths_in(svg, "stroke-dasharray=\"\"");
  REQUIRE(curves.size() == 1);
  CHECK(count_of(curves[0], 'M') == 3);  // 1 2, 3, 4 5
  CHECK(count_of(curves[0], 'L') == 2);
  for (const std::string& path : paths_in(svg, "")) CHECK(path.find_first_of("nNiI") == path.npos);
  CHECK(svg.find("a &lt; b") != svg.npos);
  CHECK(chart.has_values());
}

TEST_CASE("a chart without any known value is one without curves") {
  Chart chart = chart_of({unknown, unknown, infinity});
  chart.bands = {{"band", 0, {1, unknown, 2}}, {"of no curve", 7, {1, 1, 1}}};
  CHECK_FALSE(chart.has_values());
  CHECK_FALSE(chart_of({}).has_values());
  const std::string svg = figure_of(chart);
  for (const std::string& path : paths_in(svg, "")) CHECK(path.find_first_of("nNiI") == path.npos);
  for (const std::string& path : paths_in(svg, "class=\"curve\"")) CHECK(path.empty());
}

TEST_CASE("a band lies within the chart and is interrupted where it is unknown") {
  Chart chart = chart_of({10, 10, 10, 10, 10});
  chart.bands = {{"band", 0, {5, 5, unknown, 2, 2}}};
  chart.from_zero = false;
  const auto bands = paths_in(figure_of(chart), "fill-opacity");
  REQUIRE(bands.size() == 1);
  CHECK(count_of(bands[0], 'Z') == 2);
  const std::vector<double> heights = heights_in(bands[0]);
  REQUIRE(heights.size() == 8);
  // Half widths of 5 and 2 stay in proportion: nothing is cut off at the border.
  const double high = heights[2] - heights[1], low = heights[6] - heights[5];
  CHECK(high == doctest::Approx(2.5 * low).epsilon(0.01));
}

TEST_CASE("long curves keep their extremes and gaps") {
  std::vector<double> values(20'000, 1.0);
  values[7'001] = 9;
  values[12'345] = -3;
  values[15'000] = unknown;
  const auto curves = paths_in(figure_of(chart_of(values)), "stroke-dasharray=\"\"");
  REQUIRE(curves.size() == 1);
  std::vector<double> heights = heights_in(curves[0]);
  CHECK(heights.size() < 3'000);
  std::ranges::sort(heights);
  CHECK(heights[0] < heights[1]);
  CHECK(heights[heights.size() - 2] < heights.back());
  CHECK(count_of(curves[0], 'M') == 2);
}

TEST_CASE("a value has the decimals that its interval needs") {
  CHECK(interval_text(8.934, 0.4123) == "8.93 \u00b1 0.41");
  CHECK(interval_text(271.4, 12.3) == "271 \u00b1 12");
  CHECK(interval_text(-0.5, 3) == "-0.5 \u00b1 3.0");
  CHECK(interval_text(1234567, 2500) == "1234567 \u00b1 2500");
  CHECK(interval_text(2.5, 0) == number_text(2.5));
  CHECK(interval_text(2.5, unknown) == number_text(2.5));
  CHECK(interval_text(unknown, 1) == "\u2013");
}
