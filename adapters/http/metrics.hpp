// Metrics for Prometheus: their text format, and the page that an agent or curl reads on this machine.
#pragma once

#include "adapters/http/server.hpp"

#include <cstdint>
#include <functional>
#include <span>
#include <string>
#include <string_view>

namespace lbea::http {
/// The Prometheus text format, version 0.0.4: one block per metric, one line per set of labels.
class MetricsText {
 public:
  /// Begins a metric; its values follow. `type`: "counter", "gauge" or "histogram". Names are not checked.
  MetricsText& metric(std::string_view name, std::string_view type, std::string_view help);
  /// One value of the metric begun last. `labels`: results of label(), joined with commas; may be empty.
  MetricsText& value(std::uint64_t value, std::string_view labels = {});
  MetricsText& value(double value, std::string_view labels = {});
  MetricsText& value(float value, std::string_view labels = {});
  /// A whole histogram: `counts` per bucket, one more than `bounds`; `sum` in the unit of the bounds.
  MetricsText& histogram(std::string_view name, std::string_view help, std::span<const double> bounds,
                         std::span<const std::uint64_t> counts, double sum);

  [[nodiscard]] static std::string label(std::string_view name, std::string_view value);
  [[nodiscard]] const std::string& text() const noexcept { return text_; }

 private:
  void line(std::string_view suffix, std::string_view labels, const std::string& value);
  std::string text_, name_;
};

/// Serves /metrics on a loopback address.
class MetricsServer final : private Handler {
 public:
  /// `address`: e.g. "127.0.0.1:9464" (port 0: any free port). `page` is called in the server's thread for every
  /// request and must not throw. Throws Error{bad_config} for an address that other machines reach,
  /// Error{endpoint_unavailable} for an address that is in use.
  MetricsServer(const std::string& address, std::function<std::string()> page);
  /// As bound, with the number of the port.
  [[nodiscard]] std::string address() const { return to_string(server_.address()); }

 private:
  [[nodiscard]] Response respond(const Request& request) override;
  std::function<std::string()> page_;
  Server server_;
};
}  // namespace lbea::http
