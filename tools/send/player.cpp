#include "tools/send/player.hpp"

#include "adapters/wire/codec/codec.hpp"

#include <algorithm>
#include <atomic>
#include <thread>

namespace lbea::tool {
namespace {

using namespace std::chrono_literals;
using Clock = std::chrono::steady_clock;

constexpr auto stop_interval = 50ms;  // maximum delay until a stop is noticed

/// The cloud with a new id. In place when the socket has released the last round's message, otherwise a copy.
std::shared_ptr<const std::vector<std::byte>> relabelled(const EncodedCloud& cloud, std::uint64_t id) {
  auto message = cloud.message;
  if (message.use_count() > 2) {  // owners: playlist, this function, socket
    message = std::make_shared<std::vector<std::byte>>(*message);
  } else {
    std::atomic_thread_fence(std::memory_order_acquire);  // after the socket's last read
  }
  wire::relabel_frame(*message, id, cloud.stamp_ns.value_or(wire::wall_clock_ns()));
  return message;
}

std::chrono::nanoseconds due_time(const PlayConfig& config, std::uint64_t frame, std::size_t clouds) {
  constexpr double latest = 4e18;  // 127 years; the clock would overflow far beyond it
  const double rounds_ns = static_cast<double>(frame / clouds) * static_cast<double>(config.due_ns.back());
  const double due_ns = rounds_ns + static_cast<double>(config.due_ns[frame % clouds]);
  return std::chrono::nanoseconds(static_cast<std::int64_t>(std::min(due_ns, latest)));
}

void sleep_until(Clock::time_point due, const std::function<bool()>& stop) {
  while (!stop() && Clock::now() < due) std::this_thread::sleep_until(std::min(due, Clock::now() + stop_interval));
}

}  // namespace

PlayTally play(const std::vector<EncodedCloud>& clouds, const PlayConfig& config, wire::FrameSink& sink,
               const std::function<bool()>& stop, const std::function<void(std::uint64_t)>& progress) {
  const auto begin = Clock::now();
  wire::FrameSender sender(sink, config.session);
  for (std::uint64_t id = 0; config.rounds == 0 || id < config.rounds * clouds.size(); ++id) {
    if (config.due_ns.empty()) {
      while (!stop() && !sender.wait_ready(stop_interval)) {}
    } else {
      sleep_until(begin + due_time(config, id, clouds.size()), stop);
    }
    if (stop()) break;
    const EncodedCloud& cloud = clouds[id % clouds.size()];
    const bool fits = config.max_message_bytes == 0 || cloud.message->size() <= config.max_message_bytes;
    sender.send(fits ? relabelled(cloud, id) : nullptr);
    progress(id + 1);
  }
  if (config.ends_stream) sender.end_stream();
  PlayTally tally{sender.finish()};
  tally.seconds = std::chrono::duration<double>(Clock::now() - begin).count();
  return tally;
}

}  // namespace lbea::tool
