// The source of what the web server shows: a running test or a recording.
#pragma once

#include "adapters/http/server.hpp"
#include "tools/monitor/feeds/test_log.hpp"

#include <optional>

namespace lbea::tool {

/// The state of a test at one moment, the same bytes for every browser.
using Snapshot = std::shared_ptr<const std::string>;

class Feed {
 public:
  virtual ~Feed() = default;
  /// Rows of the curves that a browser does not have; empty when it has all. Any thread.
  [[nodiscard]] virtual std::string rows_after(LogCursors& cursors) = 0;
  /// The response for `target` (path and query); nothing when the target is unknown. Any thread.
  [[nodiscard]] virtual std::optional<http::Response> respond(std::string_view target) = 0;
};

[[nodiscard]] inline http::Response binary_response(std::string bytes) {
  return {200, "application/octet-stream", std::move(bytes)};
}
[[nodiscard]] inline http::Response text_response(unsigned status, std::string sentence) {
  return {status, "text/plain; charset=utf-8", std::move(sentence) + "\n"};
}
/// A response that the browser saves as `file_name`.
[[nodiscard]] inline http::Response file_response(std::string content_type, std::string bytes,
                                                  const std::string& file_name) {
  return {200,
          std::move(content_type),
          std::move(bytes),
          {{"Content-Disposition", "attachment; filename=\"" + file_name + "\""}}};
}
/// The curves of a test as CSV.
[[nodiscard]] inline http::Response curves_response(const TestLog& log, std::span<const std::string> simulation_names,
                                                    const std::string& file_prefix) {
  return file_response("text/csv; charset=utf-8", to_csv(log, simulation_names), file_prefix + "curves.csv");
}

}  // namespace lbea::tool
