// What the web server takes from whatever is watched: a running test or a recording.
#pragma once

#include "tools/monitor/feeds/test_log.hpp"

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <string_view>

namespace lbea::tool {

/// One state of affairs, the same bytes for every browser.
using Snapshot = std::shared_ptr<const std::string>;

struct HttpAnswer {
  unsigned status = 200;
  std::string content_type;
  std::string body;
  std::string file_name;  // to save it under; empty: to look at
};

class Feed {
 public:
  virtual ~Feed() = default;
  /// Rows of the curves that a browser does not have; empty when it has all. Any thread.
  [[nodiscard]] virtual std::string rows_after(LogCursor& cursor) = 0;
  /// Whatever else can be asked for under `target` (path and query); nothing when there is no such thing. Any thread.
  [[nodiscard]] virtual std::optional<HttpAnswer> answer(std::string_view target) = 0;
};

}  // namespace lbea::tool
