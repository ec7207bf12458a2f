#include "tools/send/player.hpp"

#include "adapters/wire/codec/codec.hpp"
#include "tools/shared/cli/wall_clock.hpp"

#include <algorithm>
#include <atomic>
#include <thread>

namespace lbea::tool {
namespace {

using namespace std::chrono_literals;
using Clock = std::chrono::steady_clock;

constexpr auto stop_interval = 50ms;  // how long a stop may go unnoticed
constexpr auto longest_farewell = 2000ms;
constexpr auto heartbeat_interval = 200ms;

/// The cloud under a new id. In place when the socket has let go of the last round's, else in a copy.
std::shared_ptr<const std::vector<std::byte>> relabelled(const EncodedCloud& cloud, std::uint64_t id) {
  auto message = cloud.message;
  if (message.use_count() > 2) {  // the playlist's, this one, and the socket's
    message = std::make_shared<std::vector<std::byte>>(*message);
  } else {
    std::atomic_thread_fence(std::memory_order_acquire);  // after the socket's last read
  }
  wire::relabel_frame(*message, id, cloud.stamp_ns.value_or(mcap::wall_clock_ns()));
  return message;
}

std::chrono::nanoseconds due_time(const PlayConfig& config, std::uint64_t frame, std::size_t clouds) {
  constexpr double latest = 4e18;  // 127 years; far beyond it the clock would overflow
  const double rounds_ns = static_cast<double>(frame / clouds) * static_cast<double>(config.due_ns.back());
  const double due_ns = rounds_ns + static_cast<double>(config.due_ns[frame % clouds]);
  return std::chrono::nanoseconds(static_cast<std::int64_t>(std::min(due_ns, latest)));
}

/// Sends frames and accounts for those that it cannot send.
class Courier {
 public:
  Courier(const PlayConfig& config, wire::FrameSink& sink) : config_(config), sink_(sink) {
    tell(wire::ControlKind::hello, longest_farewell);
  }

  void send(const EncodedCloud& cloud) {
    const std::uint64_t id = next_id_++;
    const bool fits = config_.max_message_bytes == 0 || cloud.message->size() <= config_.max_message_bytes;
    // In the order of their ids: of earlier captures that were withheld the receiver hears first.
    const bool sent = fits && has_told() && sink_.send(relabelled(cloud, id));
    last_word_ = Clock::now();
    ++(sent ? tally_.sent : tally_.refused);
    if (!sent) ++withheld_;
  }
  /// When nothing was said for a while: that the sender lives, and what it withheld.
  void keep_alive() {
    if (Clock::now() - last_word_ > heartbeat_interval) tell(wire::ControlKind::heartbeat, 0ms);
  }
  void wait_for_room(const std::function<bool()>& stop) {
    while (!stop() && !sink_.wait_ready(stop_interval)) {}
  }
  void sleep_until(Clock::time_point due, const std::function<bool()>& stop) {
    while (!stop() && Clock::now() < due) {
      std::this_thread::sleep_until(std::min(due, Clock::now() + stop_interval));
      keep_alive();
    }
  }
  PlayTally finish() {
    tell(wire::ControlKind::heartbeat, longest_farewell);
    wire::Encoder encoder;
    if (!config_.ends_stream) {
      tell(wire::ControlKind::goodbye, longest_farewell);
    } else {
      sink_.tell(encoder.end_of_stream(config_.session, next_id_), longest_farewell);
    }
    const std::uint64_t left = sink_.flush(longest_farewell);
    tally_.captured = next_id_;
    tally_.handed_over = tally_.sent - std::min(tally_.sent, left);
    return tally_;
  }

 private:
  bool has_told() { return withheld_ == 0 || tell_before_last(); }
  bool tell_before_last() {
    if (!sink_.tell(encoder_.control({config_.session, wire::ControlKind::heartbeat, next_id_ - 1, withheld_})))
      return false;
    withheld_ = 0;
    return true;
  }
  void tell(wire::ControlKind kind, std::chrono::milliseconds patience) {
    last_word_ = Clock::now();
    if (sink_.tell(encoder_.control({config_.session, kind, next_id_, withheld_}), patience)) withheld_ = 0;
  }

  const PlayConfig& config_;
  wire::FrameSink& sink_;
  wire::Encoder encoder_;
  std::uint64_t next_id_ = 0;
  std::uint64_t withheld_ = 0;  // of the ids just below next_id_, and not yet told of
  Clock::time_point last_word_{};
  PlayTally tally_;
};

}  // namespace

PlayTally play(const std::vector<EncodedCloud>& clouds, const PlayConfig& config, wire::FrameSink& sink,
               const std::function<bool()>& stop, const std::function<void(std::uint64_t)>& progress) {
  const auto begin = Clock::now();
  Courier courier(config, sink);
  for (std::uint64_t id = 0; config.rounds == 0 || id < config.rounds * clouds.size(); ++id) {
    if (config.due_ns.empty()) {
      courier.wait_for_room(stop);
    } else {
      courier.sleep_until(begin + due_time(config, id, clouds.size()), stop);
    }
    if (stop()) break;
    courier.send(clouds[id % clouds.size()]);
    progress(id + 1);
  }
  PlayTally tally = courier.finish();
  tally.seconds = std::chrono::duration<double>(Clock::now() - begin).count();
  return tally;
}

}  // namespace lbea::tool
