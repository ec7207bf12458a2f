// A running test. Results and previews are received all the time; scenes are built only while a browser waits for one.
#pragma once

#include "adapters/wire/sockets/streams.hpp"
#include "tools/monitor/feeds/feed.hpp"
#include "tools/monitor/feeds/health.hpp"
#include "tools/monitor/scene/scene.hpp"
#include "tools/monitor/web/foxglove.hpp"

#include <mutex>
#include <thread>

namespace lbea::tool {

struct LiveConfig {
  std::string results_endpoint, preview_endpoint;  // without the latter there are no clouds
  std::chrono::milliseconds interval{33};          // between two snapshots, at least
};

class LiveFeed final : public Feed {
 public:
  /// Threads of the feed call `publish` with every new snapshot, `is_awaited` before one is built, and `relay` with
  /// every valid message; several threads call `relay`.
  struct Audience {
    std::function<void(Snapshot)> publish;
    std::function<bool()> is_awaited;
    std::function<void(ViewerChannel, std::int64_t time_ns, wire::Message)> relay;
  };
  /// Throws Error{endpoint_unavailable}.
  LiveFeed(const LiveConfig& config, Model model);
  ~LiveFeed() override;

  void start(Audience audience);
  void stop();
  [[nodiscard]] std::string rows_after(LogCursor& cursor) override;
  [[nodiscard]] std::optional<http::Response> respond(std::string_view target) override;

 private:
  using Clock = std::chrono::steady_clock;
  struct WaitingCloud {
    std::uint64_t session = 0, frame_id = 0;
    std::shared_ptr<const std::vector<Point>> cloud;
  };
  void receive_results();
  void receive_clouds();
  void add(const wire::WireResult& result);
  void add(WaitingCloud cloud);
  void show(const wire::WireResult& result, std::shared_ptr<const std::vector<Point>> cloud);
  void build_snapshots();
  [[nodiscard]] Snapshot build();

  LiveConfig config_;
  Model model_;
  ModelRanges ranges_;
  ModelExports exports_;
  SceneBuilder scenes_;  // used by build_thread_ only
  wire::WireContext context_;
  wire::ResultSource results_;
  std::optional<wire::ResultSource> previews_;
  Audience audience_;

  std::mutex mutex_;  // of everything below
  TestLog log_;
  Health health_;
  wire::WireResult latest_;
  Moment moment_;
  Clock::time_point moment_time_{};
  std::deque<wire::WireResult> recent_;
  std::deque<WaitingCloud> waiting_;  // for their results
  std::uint64_t version_ = 0;
  bool model_differs_ = false;

  std::atomic<bool> stopping_{false};
  std::thread result_thread_, cloud_thread_, build_thread_;
};

}  // namespace lbea::tool
