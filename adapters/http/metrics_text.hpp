// Numbers in the text format that Prometheus reads (version 0.0.4): one block per metric, one line per label set.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <string_view>

namespace lbea::http {

class MetricsText {
 public:
  /// Begins a metric; its values follow. `type`: "counter", "gauge" or "histogram". Names are the caller's word.
  MetricsText& metric(std::string_view name, std::string_view type, std::string_view help);
  /// One value of the metric begun last. `labels` as from label(), joined with commas; may be empty.
  MetricsText& value(std::uint64_t value, std::string_view labels = {});
  MetricsText& value(double value, std::string_view labels = {});
  /// A whole histogram: `counts` per bucket, one more than `bounds`; `sum` in the bounds' unit.
  MetricsText& histogram(std::string_view name, std::string_view help, std::span<const double> bounds,
                         std::span<const std::uint64_t> counts, double sum);

  [[nodiscard]] static std::string label(std::string_view name, std::string_view value);
  [[nodiscard]] const std::string& text() const noexcept { return text_; }

 private:
  void line(std::string_view suffix, std::string_view labels, const std::string& value);
  std::string text_, name_;
};

}  // namespace lbea::http
