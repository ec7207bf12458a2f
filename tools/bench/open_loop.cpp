#include "tools/bench/open_loop.hpp"

#include "tools/bench/sending.hpp"

#include <nlohmann/json.hpp>

#include <atomic>
#include <cmath>
#include <map>
#include <numbers>
#include <thread>

namespace lbea::tool::bench {
namespace {

using namespace std::chrono_literals;
using Time = Clock::time_point;

constexpr auto last_result = 2s;  // nothing for so long after the last frame: nothing comes any more
constexpr auto spin = 200us;      // before a frame is due; sleeping would be late by as much

void wait_until(Time due) {
  if (due - Clock::now() > spin) std::this_thread::sleep_until(due - spin);
  while (Clock::now() < due) {}
}

/// Takes in results on a thread of its own until all that was sent is answered.
class Listener {
 public:
  Listener(wire::ResultSource& results, std::uint64_t session, std::size_t frames)
      : results_(results), session_(session), answered_(frames), thread_([this] { listen(); }) {}
  ~Listener() { finish(0); }
  void finish(std::uint64_t expected) {
    expected_ = expected;
    if (thread_.joinable()) thread_.join();
  }
  /// When the frame's match was here; nothing when it was not matched.
  [[nodiscard]] Time matched_at(std::uint64_t id) const { return answered_[id]; }

 private:
  void listen() {
    wire::WireResult result;
    Time latest = Clock::now();
    for (std::uint64_t seen = 0; seen < expected_ && Clock::now() - latest < last_result;) {
      const auto message = results_.receive(50ms);
      const Time now = Clock::now();
      if (expected_ == until_told) latest = now;
      if (!message || wire::decode_result(*message, result) != wire::WireStatus::ok || result.session != session_ ||
          result.frame_id >= answered_.size())
        continue;
      ++seen;
      latest = now;
      if (wire::fate_of(result.status) == wire::Fate::matched) answered_[result.frame_id] = now;
    }
  }

  static constexpr std::uint64_t until_told = std::numeric_limits<std::uint64_t>::max();
  wire::ResultSource& results_;
  std::uint64_t session_;
  std::atomic<std::uint64_t> expected_ = until_told;
  std::vector<Time> answered_;
  std::thread thread_;
};

}  // namespace

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
  Sending sending(endpoints, clouds);
  const std::size_t frames = std::size_t{schedule.warm_up} + schedule.frames;
  Listener listener(sending.results(), sending.session(), frames);
  OpenLoop run;
  std::vector<Time> due;  // of those sent: numbers without gaps, whatever was refused
  std::uint64_t refused_warm_up = 0;
  const Time begin = Clock::now();
  for (std::uint64_t i = 0; i < frames; ++i) {
    const Time now_due = begin + std::chrono::duration_cast<Clock::duration>(
                                     std::chrono::duration<double>(static_cast<double>(i) / rate));
    wait_until(now_due);
    if (sending.send(due.size(), 0ms))
      due.push_back(now_due);
    else
      ++(i < schedule.warm_up ? refused_warm_up : run.refused);
    progress(i + 1);
  }
  listener.finish(due.size());
  const std::uint64_t first = schedule.warm_up - refused_warm_up;
  Time last = begin + std::chrono::duration_cast<Clock::duration>(
                          std::chrono::duration<double>(static_cast<double>(frames - 1) / rate));
  for (std::uint64_t id = first; id < due.size(); ++id) {
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
  char line[256];
  std::snprintf(line, sizeof(line), "%llu frames in %.1f s: matched %llu, lost %llu, refused %llu\n",
                static_cast<unsigned long long>(run.sent + run.refused), run.seconds,
                static_cast<unsigned long long>(run.matched), static_cast<unsigned long long>(run.lost),
                static_cast<unsigned long long>(run.refused));
  std::string text = line;
  std::snprintf(line, sizeof(line),
                "from when a frame was due to its result, us: p50 %.0f, p90 %.0f, p99 %.0f, p99.9 %.0f, max %.0f\n",
                s.p50, s.p90, s.p99, s.p99_9, s.max);
  text += line;
  const std::vector<Bucket> buckets = histogram_of(run.since_due);
  std::size_t most = 1;
  for (const Bucket& bucket : buckets) most = std::max(most, bucket.count);
  for (const auto& [up_to, count] : buckets) {
    std::snprintf(line, sizeof(line), "  up to %8.2f ms %9zu ", up_to / 1000, count);
    text += line + std::string((60 * count + most - 1) / most, '#') + "\n";
  }
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
