#include "tools/monitor/feeds/live_feed.hpp"

#include "adapters/wire/codec/codec.hpp"
#include "tools/monitor/feeds/frame_results.hpp"
#include "tools/monitor/feeds/health.hpp"
#include "tools/monitor/scene/shown_components.hpp"

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
  Live(const std::string& results_endpoint, const std::string& preview_endpoint, const std::vector<NamedModel>& models)
      : components_(models),
        description_(components_.description(nullptr)),
        results_(context_, results_endpoint),
        logs_(models.size()),
        latest_(models.size()),
        pending_(models.size()),
        moment_{std::vector<wire::WireResult>(models.size())},
        models_differ_(models.size()) {
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
  [[nodiscard]] std::string rows_after(LogCursors& cursors) override {
    const std::lock_guard lock(mutex_);
    return next_rows(logs_, cursors, rows_at_once);
  }
  [[nodiscard]] std::optional<http::Response> respond(std::string_view target) override {
    const std::string_view path = target.substr(0, target.find('?'));
    if (path == "/api/model") return binary_response(description_);
    const auto component = components_.component_in(target);
    if (path != "/export/curves.csv" || !component) return components_.respond(target);
    const std::lock_guard lock(mutex_);
    return curves_response(logs_[*component], components_.simulation_names(*component),
                           components_.file_prefix(*component));
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
      for (std::size_t i = 0; is_state && i < components_.size(); ++i)
        models_differ_[i] = !has_model(state, components_.model(i).checksum());
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

  [[nodiscard]] static bool has_model(const wire::WireState& state, std::uint64_t checksum) {
    const auto is_this = [&](const wire::WireComponent& c) { return c.model.checksum == checksum; };
    return state.model.checksum == checksum || std::ranges::any_of(state.components, is_this);
  }

  void add(const wire::WireResult& result) {
    const std::vector<std::size_t> concerned = components_.concerned(result);
    if (concerned.empty()) return health_.add_other(result);
    for (const std::size_t i : concerned) logs_[i].add(result);
    if (concerned.front() == 0)
      health_.add(result);
    else
      health_.add_other(result);
    if (result.status == wire::WireStatus::end_of_stream) return show(pending_.take());
    if (concerned.size() == components_.size()) return show(FrameResults(components_.size(), result));
    if (!pending_.is_of(result)) show(pending_.take());
    pending_.add(concerned.front(), result);
    if (pending_.is_complete()) show(pending_.take());
  }

  void add(WaitingCloud cloud) {
    const auto results = std::ranges::find_if(recent_, [&](const FrameResults& r) { return answers(r, cloud); });
    if (results != recent_.end()) return show(*results, cloud);
    waiting_.push_back(std::move(cloud));
    if (waiting_.size() > waiting_clouds) waiting_.pop_front();
  }
  static bool answers(const FrameResults& results, const WaitingCloud& cloud) {
    bool is_answer = false;
    wire::for_each_frame(results.first(), [&](std::uint64_t session, std::uint64_t id, wire::WireStatus) {
      is_answer = is_answer || (session == cloud.session && id == cloud.frame_id);
    });
    return is_answer;
  }
  void show(FrameResults results) {
    if (results.is_empty()) return;
    results.copy_to(latest_);
    const auto cloud =
        std::find_if(waiting_.rbegin(), waiting_.rend(), [&](const WaitingCloud& w) { return answers(results, w); });
    if (cloud != waiting_.rend()) {
      show(results, *cloud);
      const std::uint64_t shown = cloud->session, last = cloud->frame_id;
      std::erase_if(waiting_, [&](const WaitingCloud& w) { return w.session == shown && w.frame_id <= last; });
    } else if (Clock::now() - moment_time_ > cloudless_after && results.is_matched()) {
      results.copy_to(moment_.results);
      moment_.cloud = nullptr;
    }
    recent_.push_back(std::move(results));
    if (recent_.size() > recent_results) recent_.pop_front();
  }
  /// With several rigs, beside the latest clouds of the others: previews are not of the same captures.
  void show(const FrameResults& results, const WaitingCloud& cloud) {
    moment_time_ = Clock::now();
    results.copy_to(moment_.results);
    moment_.cloud = cloud.cloud;
    if (results.first().rigs.empty()) return;
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
    AssembledMoment moment;
    nlohmann::json head;
    std::vector<nlohmann::json> heads;
    {
      const std::lock_guard lock(mutex_);
      moment = moment_;
      head = {{"version", version_}, {"health", health_.report()}, {"has_preview", previews_.has_value()}};
      for (std::size_t i = 0; i < components_.size(); ++i)
        heads.push_back({{"type", "snapshot"},
                         {"result", to_json(latest_[i])},
                         {"test", to_json(logs_[i], latest_[i].stamp_ns, components_.simulation_names(i))},
                         {"model_differs", static_cast<bool>(models_differ_[i])}});
    }
    return std::make_shared<const std::string>(components_.build(moment, std::move(head), std::move(heads)));
  }

  ShownComponents components_;
  std::string description_;
  wire::WireContext context_;
  wire::ResultSource results_;
  std::optional<wire::ResultSource> previews_;
  Audience audience_;

  std::mutex mutex_;  // of everything below
  std::vector<TestLog> logs_;
  Health health_;
  std::vector<wire::WireResult> latest_;
  FrameResults pending_;
  AssembledMoment moment_;
  Clock::time_point moment_time_{};
  std::deque<FrameResults> recent_;
  std::deque<WaitingCloud> waiting_;  // for their results
  std::map<std::uint64_t, std::pair<Clock::time_point, std::shared_ptr<const std::vector<Point>>>>
      shown_;  // by session
  std::uint64_t version_ = 0;
  std::vector<bool> models_differ_;

  std::atomic<bool> stopping_{false};
  std::thread result_thread_, cloud_thread_, build_thread_;
};

}  // namespace

std::unique_ptr<LiveFeed> make_live_feed(const std::string& results_endpoint, const std::string& preview_endpoint,
                                         const std::vector<NamedModel>& models) {
  return std::make_unique<Live>(results_endpoint, preview_endpoint, models);
}

}  // namespace lbea::tool
