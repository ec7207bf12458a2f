#include "tools/bench/round_trip.hpp"

#include "adapters/wire/codec/codec.hpp"
#include "adapters/wire/sockets/streams.hpp"
#include "tools/shared/text/formatted.hpp"

#include <lbea/lbea.hpp>

#include <nlohmann/json.hpp>

#include <atomic>
#include <chrono>
#include <map>
#include <numbers>
#include <random>
#include <thread>

namespace lbea::tool::bench {
namespace {

using namespace std::chrono_literals;
using Clock = std::chrono::steady_clock;
using Time = Clock::time_point;

constexpr auto response_timeout = 5s;
constexpr auto last_result = 2s;  // after so long without a result the remaining frames count as lost
constexpr auto spin = 200us;      // busy waiting before a frame is due: a sleep can end this much too late

/// Waits for a state message: from then on no result can be missed.
void wait_for_state(wire::ResultSource& results, const Endpoints& endpoints) {
  for (const auto begin = Clock::now(); Clock::now() - begin < response_timeout;)
    if (const auto message = results.receive(100ms);
        message && wire::message_kind(*message) == wire::MessageKind::state)
      return;
  throw Error(Status::endpoint_unavailable, endpoints.results + ": no publisher at this endpoint; start lbea-serve");
}

/// Sends encoded clouds to a running lbea-serve and receives its results.
class Sender {
 public:
  /// Encodes the clouds and connects. Throws Error{endpoint_unavailable} when within five seconds no receiver of frames
  /// or no publisher of results is connected.
  Sender(const Endpoints& endpoints, std::span<const BenchCloud> clouds)
      : session_(std::random_device{}()),
        clouds_(clouds),
        frames_(context_, endpoints.frames),
        results_(context_, endpoints.results) {
    wire::Encoder encoder;
    for (const BenchCloud& cloud : clouds) {
      const auto message = encoder.frame({0, cloud.frame().stamp_ns, cloud.points}, session_);
      sizes_.push_back(message.size());
      std::ranges::copy(message,
                        std::as_writable_bytes(std::span(messages_.emplace_back((message.size() + 7) / 8))).begin());
    }
    if (!frames_.wait_ready(response_timeout))
      throw Error(Status::endpoint_unavailable, endpoints.frames + ": no receiver at this endpoint; start lbea-serve");
    wait_for_state(results_, endpoints);
  }

  /// Sends the next cloud in turn as frame `id`. False: the send queue is full.
  [[nodiscard]] bool send(std::uint64_t id, std::chrono::milliseconds timeout) {
    const std::size_t cloud = id % clouds_.size();
    const auto message = std::as_writable_bytes(std::span(messages_[cloud])).first(sizes_[cloud]);
    wire::relabel_frame(message, id, clouds_[cloud].frame().stamp_ns);
    return frames_.send(message, timeout);
  }
  [[nodiscard]] wire::ResultSource& results() noexcept { return results_; }
  [[nodiscard]] std::uint64_t session() const noexcept { return session_; }

 private:
  using Encoded = std::vector<std::uint64_t>;  // 8-byte aligned

  std::uint64_t session_;
  std::span<const BenchCloud> clouds_;
  std::vector<Encoded> messages_;
  std::vector<std::size_t> sizes_;
  wire::WireContext context_;
  wire::FrameSink frames_;
  wire::ResultSource results_;
};

void wait_for_result(wire::ResultSource& results, std::uint64_t session, std::uint64_t id, const Endpoints& endpoints) {
  for (const auto begin = Clock::now(); Clock::now() - begin < response_timeout;) {
    const auto message = results.receive(100ms);
    wire::WireResult result;
    if (message && wire::decode_result(*message, result) == wire::WireStatus::ok && result.session == session &&
        result.frame_id == id)
      return;
  }
  throw Error(Status::endpoint_unavailable, endpoints.results + ": no result for frame " + std::to_string(id));
}

void wait_until(Time due) {
  if (due - Clock::now() > spin) std::this_thread::sleep_until(due - spin);
  while (Clock::now() < due) {}
}

/// Receives results on its own thread until every sent frame has one.
class ResultListener {
 public:
  ResultListener(wire::ResultSource& results, std::uint64_t session, std::size_t frames)
      : results_(results), session_(session), matched_at_(frames), thread_([this] { listen(); }) {}
  ~ResultListener() { finish(0); }
  /// Waits until `expected` results have arrived or no more arrive.
  void finish(std::uint64_t expected) {
    expected_ = expected;
    if (thread_.joinable()) thread_.join();
  }
  /// Arrival time of the result of a matched frame; Time{} for a frame that was not matched.
  [[nodiscard]] Time matched_at(std::uint64_t id) const { return matched_at_[id]; }

 private:
  void listen() {
    wire::WireResult result;
    Time latest = Clock::now();
    for (std::uint64_t seen = 0; seen < expected_ && Clock::now() - latest < last_result;) {
      const auto message = results_.receive(50ms);
      const Time now = Clock::now();
      if (expected_ == not_known) latest = now;
      if (!message || wire::decode_result(*message, result) != wire::WireStatus::ok || result.session != session_ ||
          result.frame_id >= matched_at_.size())
        continue;
      ++seen;
      latest = now;
      if (wire::fate_of(result.status) == wire::Fate::matched) matched_at_[result.frame_id] = now;
    }
  }

  static constexpr std::uint64_t not_known = std::numeric_limits<std::uint64_t>::max();
  wire::ResultSource& results_;
  std::uint64_t session_;
  std::atomic<std::uint64_t> expected_ = not_known;
  std::vector<Time> matched_at_;
  std::thread thread_;
};

}  // namespace

Endpoints parse_endpoints(const std::string& both) {
  const auto comma = both.find(',');
  if (comma == std::string::npos || comma == 0 || comma + 1 == both.size())
    throw Error(Status::bad_config, both + ": give the endpoints of a running lbea-serve as FRAMES,RESULTS");
  return {both.substr(0, comma), both.substr(comma + 1)};
}

std::vector<double> round_trips(const Endpoints& endpoints, std::span<const BenchCloud> clouds,
                                const Schedule& schedule, const std::function<void(std::uint64_t)>& progress) {
  Sender sender(endpoints, clouds);
  std::vector<double> times;
  for (std::uint64_t id = 0; id < std::uint64_t{schedule.warm_up} + schedule.frames; ++id) {
    const auto begin = Clock::now();
    if (!sender.send(id, response_timeout))
      throw Error(Status::endpoint_unavailable, endpoints.frames + ": the send queue was full for 5 s");
    wait_for_result(sender.results(), sender.session(), id, endpoints);
    if (id >= schedule.warm_up)
      times.push_back(std::chrono::duration<double, std::micro>(Clock::now() - begin).count());
    progress(id + 1);
  }
  return times;
}

std::vector<Bucket> histogram_of(std::span<const double> values) {
  std::map<int, std::size_t> counts;
  for (const double value : values) ++counts[static_cast<int>(std::ceil(2 * std::log2(std::max(value, 1.0))))];
  std::vector<Bucket> buckets;
  if (counts.empty()) return buckets;
  for (int k = counts.begin()->first; k <= counts.rbegin()->first; ++k)
    buckets.push_back({std::pow(std::numbers::sqrt2, k), counts.contains(k) ? counts[k] : 0});
  return buckets;
}

OpenLoop open_loop(const Endpoints& endpoints, std::span<const BenchCloud> clouds, const Schedule& schedule,
                   double rate, const std::function<void(std::uint64_t)>& progress) {
  Sender sender(endpoints, clouds);
  const std::size_t frames = std::size_t{schedule.warm_up} + schedule.frames;
  ResultListener listener(sender.results(), sender.session(), frames);
  OpenLoop run;
  std::vector<Time> due;  // of the sent frames, which are numbered without gaps
  std::uint64_t refused_warm_up = 0;
  const Time begin = Clock::now();
  const auto due_time = [&](std::uint64_t frame) {
    return begin + std::chrono::duration_cast<Clock::duration>(
                       std::chrono::duration<double>(static_cast<double>(frame) / rate));
  };
  for (std::uint64_t i = 0; i < frames; ++i) {
    wait_until(due_time(i));
    if (sender.send(due.size(), 0ms))
      due.push_back(due_time(i));
    else
      ++(i < schedule.warm_up ? refused_warm_up : run.refused);
    progress(i + 1);
  }
  listener.finish(due.size());
  Time last = due_time(frames - 1);
  for (std::uint64_t id = schedule.warm_up - refused_warm_up; id < due.size(); ++id) {
    ++run.sent;
    const Time matched = listener.matched_at(id);
    if (matched == Time{}) {
      ++run.lost;
      continue;
    }
    ++run.matched;
    last = std::max(last, matched);
    run.since_due.push_back(std::chrono::duration<double, std::micro>(matched - due[id]).count());
  }
  run.seconds = std::chrono::duration<double>(last - begin).count() - static_cast<double>(schedule.warm_up) / rate;
  return run;
}

std::string to_text(const OpenLoop& run) {
  const Statistics s = statistics_of(run.since_due);
  const auto count = [](std::uint64_t frames) { return static_cast<unsigned long long>(frames); };
  std::string text =
      formatted("%llu frames in %.1f s: matched %llu, lost %llu, refused %llu\n", count(run.sent + run.refused),
                run.seconds, count(run.matched), count(run.lost), count(run.refused));
  text += formatted("from due time to result, us: p50 %.0f, p90 %.0f, p99 %.0f, p99.9 %.0f, max %.0f\n", s.p50, s.p90,
                    s.p99, s.p99_9, s.max);
  const std::vector<Bucket> buckets = histogram_of(run.since_due);
  std::size_t most = 1;
  for (const Bucket& bucket : buckets) most = std::max(most, bucket.count);
  for (const Bucket& bucket : buckets)
    text += formatted("  up to %8.2f ms %9zu ", bucket.up_to / 1000, bucket.count) +
            std::string((60 * bucket.count + most - 1) / most, '#') + "\n";
  return text;
}

std::string to_json(const OpenLoop& run) {
  const Statistics s = statistics_of(run.since_due);
  nlohmann::ordered_json json{
      {"sent", run.sent},
      {"refused", run.refused},
      {"matched", run.matched},
      {"lost", run.lost},
      {"seconds", run.seconds},
      {"since_due_us", {{"p50", s.p50}, {"p90", s.p90}, {"p99", s.p99}, {"p99.9", s.p99_9}, {"max", s.max}}}};
  for (const auto& [up_to, count] : histogram_of(run.since_due))
    json["histogram"].push_back({{"up_to_us", up_to}, {"frames", count}});
  return json.dump(2);
}

}  // namespace lbea::tool::bench
