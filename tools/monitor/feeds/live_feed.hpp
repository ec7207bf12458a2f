// A running test. Results and previews are received all the time; scenes are built only while a browser waits for one.
#pragma once

#include "adapters/wire/sockets/streams.hpp"
#include "tools/monitor/feeds/feed.hpp"
#include "tools/monitor/web/foxglove.hpp"
#include "tools/shared/matching/named_models.hpp"

#include <functional>

namespace lbea::tool {

class LiveFeed : public Feed {
 public:
  /// Threads of the feed call `publish` with every new snapshot, `is_awaited` before one is built, and `relay` with
  /// every valid message; several threads call `relay`.
  struct Audience {
    std::function<void(Snapshot)> publish;
    std::function<bool()> is_awaited;
    std::function<void(ViewerChannel, std::int64_t time_ns, wire::Message)> relay;
  };
  virtual void start(Audience audience) = 0;
  virtual void stop() = 0;
};

/// Without `preview_endpoint` there are no clouds. Throws Error{endpoint_unavailable}.
[[nodiscard]] std::unique_ptr<LiveFeed> make_live_feed(const std::string& results_endpoint,
                                                       const std::string& preview_endpoint,
                                                       const std::vector<NamedModel>& models);

}  // namespace lbea::tool
