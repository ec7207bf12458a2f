// The quantities of interest of a test as files for other programs: ISO/TS 13499 (ISO-MME) and CSV.
#pragma once

#include "adapters/export/mme.hpp"
#include "tools/report/content/test_report.hpp"

namespace lbea::tool {

/// Values at equidistant times.
struct EvenSamples {
  double first_s = 0, interval_s = 0;
  std::vector<double> values;  // NaN: unknown
};

/// `times_s` increase; values may be NaN. Times that lie on a grid of their median interval, except for gaps, keep
/// their values. Others: linear between neighbors less than one and a half intervals apart, else NaN. At most ten times
/// as many values; a single one has an interval of 1 ms.
[[nodiscard]] EvenSamples evenly_sampled(std::span<const double> times_s, std::span<const double> values);

/// Each channel of the test and, where the model has it, of the simulation that explains it, in SI units, times since
/// the impact; since the first frame if the impact is not known. Throws Error{bad_input} without channels, and when the
/// capture times do not increase.
[[nodiscard]] io::MmeTest mme_of(const TestReport& report);

/// A row per matched frame: id, time, and per channel value, half width of its 90 % interval and value of the
/// simulation, in the model's units. Nothing in doubtful frames. Throws Error{bad_input} without channels.
[[nodiscard]] std::string csv_of(const TestReport& report);

}  // namespace lbea::tool
