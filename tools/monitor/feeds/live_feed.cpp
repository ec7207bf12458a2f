#include "tools/monitor/feeds/live_feed.hpp"
#include "tools/shared/intake/component_results.hpp"

#include "adapters/wire/codec/codec.hpp"
#include "tools/monitor/feeds/health.hpp"
#include "tools/monitor/scene/scene.hpp"

#include <nlohmann/json.hpp>

#include <algorithm>
#include <map>
#include <mutex>
#include <thread>

namespace lbea::tool {
namespace {

using namespace std::chrono_literals;

constexpr auto min_interval = 33ms;  // between two snapshots
constexpr auto receive_timeout = 100ms;
constexpr auto heartbeat = 500ms;     // longest time between snapshots: ages grow while nothing is received
constexpr auto cloudless_after = 1s;  // without a new cloud; then the view continues without one
constexpr std::size_t recent_results = 256, waiting_clouds = 8;
constexpr std::size_t rows_at_once = 2048;
constexpr int previews_held = 2;

class Live final : public LiveFeed {
 public:
  Live(const std::string& results_endpoint, const std::string& preview_endpoint, Model model)
      : model_(std::move(model)),
        ranges_(ranges_of(model_)),
        exports_(model_, ranges_),
        scenes_(model_, ranges_),
        results_(context_, results_endpoint) {
    if (!preview_endpoint.empty()) previews_.emplace(context_, preview_endpoint, previews_held);
  }
  ~Live() override { stop(); }

  void start(Audience audience) override {
    audience_ = std::move(audience);
    result_thread_ = std::thread(&Live::receive_results, this);
    if (previews_) cloud_thread_ = std::thread(&Live::receive_clouds, this);
    build_thread_ = std::thread(&Live::build_snapshots, this);
  }
  void stop() override {
    stopping_ = true;
    for (std::thread* thread : {&result_thread_, &cloud_thread_, &build_thread_})
      if (thread->joinable()) thread->join();
  }
  [[nodiscard]] std::string rows_after(LogCursor& cursor) override {
    const std::lock_guard lock(mutex_);
    return next_rows(log_, cursor, rows_at_once);
  }
  [[nodiscard]] std::optional<http::Response> respond(std::string_view target) override {
    if (target == "/export/curves.csv") {
      const std::lock_guard lock(mutex_);
      return file_response("text/csv; charset=utf-8", to_csv(log_, exports_.simulation_names()), "curves.csv");
    }
    return exports_.respond(target);
  }

 private:
  using Clock = std::chrono::steady_clock;
  struct WaitingCloud {
    std::uint64_t session = 0, frame_id = 0;
    std::shared_ptr<const std::vector<Point>> cloud;
  };

  void receive_results() {
    wire::WireResult result;
    wire::WireState state;
    while (!stopping_) {
      const auto message = results_.receive(receive_timeout);
      if (!message) continue;
      const wire::MessageKind kind = wire::message_kind(*message);
      const bool is_result =
          kind == wire::MessageKind::result && wire::decode_result(*message, result) == wire::WireStatus::ok;
      const bool is_state =
          kind == wire::MessageKind::state && wire::decode_state(*message, state) == wire::WireStatus::ok;
      if (is_result) audience_.relay(ViewerChannel::results, result.publish_ns, *message);
      if (is_state) audience_.relay(ViewerChannel::state, state.publish_ns, *message);
      const std::lock_guard lock(mutex_);
      ++version_;
      if (is_result)
        add(result);
      else if (is_state)
        health_.add(state);
      else
        health_.add_unreadable();
      if (is_state) model_differs_ = !has_model(state);
    }
  }

  void receive_clouds() {
    wire::FrameDecoder decoder;
    while (!stopping_) {
      const auto message = previews_->receive(receive_timeout);
      if (!message || decoder.open(*message) != wire::WireStatus::ok) continue;
      const wire::FrameHeader& header = decoder.header();
      std::vector<Point> points(header.points);
      decoder.read_points(points);
      audience_.relay(ViewerChannel::frames, wire::wall_clock_ns(), header.cloud);
      const std::lock_guard lock(mutex_);
      ++version_;
      add({header.session, header.id, std::make_shared<const std::vector<Point>>(std::move(points))});
    }
  }

  [[nodiscard]] bool has_model(const wire::WireState& state) const {
    const auto is_this = [&](const wire::WireComponent& c) { return c.model.checksum == model_.checksum(); };
    return state.model.checksum == model_.checksum() || std::ranges::any_of(state.components, is_this);
  }

  void add(const wire::WireResult& result) {
    if (!concerns(result, model_.checksum())) return health_.add_other(result);
    log_.add(result);
    health_.add(result);
    if (result.status == wire::WireStatus::end_of_stream) return;
    latest_ = result;
    const auto cloud =
        std::find_if(waiting_.rbegin(), waiting_.rend(), [&](const WaitingCloud& w) { return answers(result, w); });
    if (cloud != waiting_.rend()) {
      show(result, *cloud);
      const std::uint64_t shown = cloud->session, last = cloud->frame_id;
      std::erase_if(waiting_, [&](const WaitingCloud& w) { return w.session == shown && w.frame_id <= last; });
    } else if (Clock::now() - moment_time_ > cloudless_after && wire::fate_of(result.status) == wire::Fate::matched) {
      moment_ = {result, nullptr};
    }
    recent_.push_back(result);
    if (recent_.size() > recent_results) recent_.pop_front();
  }

  void add(WaitingCloud cloud) {
    const auto result = std::ranges::find_if(recent_, [&](const wire::WireResult& r) { return answers(r, cloud); });
    if (result != recent_.end()) return show(*result, cloud);
    waiting_.push_back(std::move(cloud));
    if (waiting_.size() > waiting_clouds) waiting_.pop_front();
  }
  static bool answers(const wire::WireResult& result, const WaitingCloud& cloud) {
    bool is_answer = false;
    wire::for_each_frame(result, [&](std::uint64_t session, std::uint64_t id, wire::WireStatus) {
      is_answer = is_answer || (session == cloud.session && id == cloud.frame_id);
    });
    return is_answer;
  }
  /// With several rigs, beside the latest clouds of the others: previews are not of the same captures.
  void show(const wire::WireResult& result, const WaitingCloud& cloud) {
    moment_time_ = Clock::now();
    moment_ = {result, cloud.cloud};
    if (result.rigs.empty()) return;
    shown_[cloud.session] = {moment_time_, cloud.cloud};
    std::erase_if(shown_, [&](const auto& shown) { return moment_time_ - shown.second.first > cloudless_after; });
    std::vector<Point> all;
    for (const auto& [session, shown] : shown_) all.insert(all.end(), shown.second->begin(), shown.second->end());
    moment_.cloud = std::make_shared<const std::vector<Point>>(std::move(all));
  }

  void build_snapshots() {
    std::uint64_t built = 0;
    auto last = Clock::time_point{};
    while (!stopping_) {
      const auto begin = Clock::now();
      std::uint64_t version = 0;
      {
        const std::lock_guard lock(mutex_);
        version = version_;
      }
      if (audience_.is_awaited() && (version != built || begin - last > heartbeat)) {
        audience_.publish(build());
        built = version;
        last = begin;
      }
      // Uses at most half of one core.
      std::this_thread::sleep_for(
          std::max<Clock::duration>(min_interval - (Clock::now() - begin), Clock::now() - begin));
    }
  }

  [[nodiscard]] Snapshot build() {
    Moment moment;
    nlohmann::json head{{"type", "snapshot"}};
    {
      const std::lock_guard lock(mutex_);
      moment = moment_;
      head["version"] = version_;
      head["result"] = to_json(latest_);
      head["health"] = health_.report();
      head["test"] = to_json(log_, latest_.stamp_ns, exports_.simulation_names());
      head["model_differs"] = model_differs_;
      head["has_preview"] = previews_.has_value();
    }
    return std::make_shared<const std::string>(scenes_.build(moment, std::move(head)));
  }

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
  std::map<std::uint64_t, std::pair<Clock::time_point, std::shared_ptr<const std::vector<Point>>>>
      shown_;  // by session
  std::uint64_t version_ = 0;
  bool model_differs_ = false;

  std::atomic<bool> stopping_{false};
  std::thread result_thread_, cloud_thread_, build_thread_;
};

}  // namespace

std::unique_ptr<LiveFeed> make_live_feed(const std::string& results_endpoint, const std::string& preview_endpoint,
                                         Model model) {
  return std::make_unique<Live>(results_endpoint, preview_endpoint, std::move(model));
}

}  // namespace lbea::tool
