#include "tools/send/player.hpp"

#include "adapters/wire/codec.hpp"

#include <algorithm>
#include <atomic>
#include <thread>

namespace lbea {

namespace {

using namespace std::chrono_literals;
using Clock = std::chrono::steady_clock;

constexpr auto stop_interval = 50ms;  // how long a stop may go unnoticed
constexpr auto longest_farewell = 2000ms;

std::int64_t now_ns() {
  return std::chrono::duration_cast<std::chrono::nanoseconds>(
             std::chrono::system_clock::now().time_since_epoch())
      .count();
}

void sleep_until(Clock::time_point due, const std::function<bool()>& stop) {
  while (!stop() && Clock::now() < due)
    std::this_thread::sleep_until(std::min(due, Clock::now() + stop_interval));
}

void wait_for_room(FrameSink& sink, const std::function<bool()>& stop) {
  while (!stop() && !sink.wait_ready(stop_interval)) {}
}

/// The cloud under a new id. In place when the socket has let go of the last round's, else in a copy.
std::shared_ptr<const std::vector<std::byte>> relabelled(const EncodedCloud& cloud, std::uint64_t id) {
  auto message = cloud.message;
  if (message.use_count() > 2) {  // the playlist's, this one, and the socket's
    message = std::make_shared<std::vector<std::byte>>(*message);
  } else {
    std::atomic_thread_fence(std::memory_order_acquire);  // after the socket's last read
  }
  relabel_frame(*message, id, cloud.stamp_ns.value_or(now_ns()));
  return message;
}

std::chrono::nanoseconds due_time(const PlayConfig& config, std::uint64_t frame, std::size_t clouds) {
  constexpr double latest = 4e18;  // 127 years; far beyond it the clock would overflow
  const double rounds_ns = static_cast<double>(frame / clouds) * static_cast<double>(config.due_ns.back());
  const double due_ns = rounds_ns + static_cast<double>(config.due_ns[frame % clouds]);
  return std::chrono::nanoseconds(static_cast<std::int64_t>(std::min(due_ns, latest)));
}

void say_farewell(FrameSink& sink, const PlayConfig& config, std::uint64_t next_id) {
  Encoder encoder;
  if (config.ends_stream && sink.wait_ready(longest_farewell))
    sink.send(encoder.end_of_stream(config.session, next_id));
}

}  // namespace

PlayTally play(const std::vector<EncodedCloud>& clouds, const PlayConfig& config, FrameSink& sink,
               const std::function<bool()>& stop, const std::function<void(std::uint64_t)>& progress) {
  const auto begin = Clock::now();
  std::uint64_t id = 0;
  for (; config.rounds == 0 || id < config.rounds * clouds.size(); ++id) {
    if (config.due_ns.empty()) {
      wait_for_room(sink, stop);
    } else {
      sleep_until(begin + due_time(config, id, clouds.size()), stop);
    }
    if (stop()) break;
    sink.send(relabelled(clouds[id % clouds.size()], id));
    progress(id + 1);
  }
  const FrameSink::Tally frames = sink.tally();
  say_farewell(sink, config, id);
  const std::uint64_t left = sink.flush(longest_farewell);
  return {id, frames.sent, frames.refused, frames.sent - std::min(frames.sent, left),
          std::chrono::duration<double>(Clock::now() - begin).count()};
}

}  // namespace lbea
