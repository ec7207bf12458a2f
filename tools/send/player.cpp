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

constexpr auto stop_interval = 50ms;  // maximum delay until a stop is noticed
constexpr auto max_flush = 2000ms;
constexpr auto heartbeat_interval = 200ms;

/// The cloud with a new id. In place when the socket has released the last round's message, otherwise a copy.
std::shared_ptr<const std::vector<std::byte>> relabelled(const EncodedCloud& cloud, std::uint64_t id) {
  auto message = cloud.message;
  if (message.use_count() > 2) {  // owners: playlist, this function, socket
    message = std::make_shared<std::vector<std::byte>>(*message);
  } else {
    std::atomic_thread_fence(std::memory_order_acquire);  // after the socket's last read
  }
  wire::relabel_frame(*message, id, cloud.stamp_ns.value_or(wall_clock_ns()));
  return message;
}

std::chrono::nanoseconds due_time(const PlayConfig& config, std::uint64_t frame, std::size_t clouds) {
  constexpr double latest = 4e18;  // 127 years; the clock would overflow far beyond it
  const double rounds_ns = static_cast<double>(frame / clouds) * static_cast<double>(config.due_ns.back());
  const double due_ns = rounds_ns + static_cast<double>(config.due_ns[frame % clouds]);
  return std::chrono::nanoseconds(static_cast<std::int64_t>(std::min(due_ns, latest)));
}

/// Sends frames and reports those that it cannot send.
class FrameSender {
 public:
  FrameSender(const PlayConfig& config, wire::FrameSink& sink) : config_(config), sink_(sink) {
    send_control(wire::ControlKind::hello, max_flush);
  }

  void send(const EncodedCloud& cloud) {
    const std::uint64_t id = next_id_++;
    const bool fits = config_.max_message_bytes == 0 || cloud.message->size() <= config_.max_message_bytes;
    // Withheld captures are reported before later frames are sent, so that ids arrive in order.
    const bool sent = fits && has_reported() && sink_.send(relabelled(cloud, id));
    last_message_ = Clock::now();
    ++(sent ? tally_.sent : tally_.refused);
    if (!sent) ++withheld_;
  }
  /// After a pause: sends a heartbeat, which also reports withheld captures.
  void keep_alive() {
    if (Clock::now() - last_message_ > heartbeat_interval) send_control(wire::ControlKind::heartbeat, 0ms);
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
    send_control(wire::ControlKind::heartbeat, max_flush);
    wire::Encoder encoder;
    if (!config_.ends_stream) {
      send_control(wire::ControlKind::goodbye, max_flush);
    } else {
      sink_.tell(encoder.end_of_stream(config_.session, next_id_), max_flush);
    }
    const std::uint64_t left = sink_.flush(max_flush);
    tally_.captured = next_id_;
    tally_.handed_over = tally_.sent - std::min(tally_.sent, left);
    return tally_;
  }

 private:
  bool has_reported() { return withheld_ == 0 || report_before_last(); }
  bool report_before_last() {
    if (!sink_.tell(encoder_.control({config_.session, wire::ControlKind::heartbeat, next_id_ - 1, withheld_})))
      return false;
    withheld_ = 0;
    return true;
  }
  void send_control(wire::ControlKind kind, std::chrono::milliseconds timeout) {
    last_message_ = Clock::now();
    if (sink_.tell(encoder_.control({config_.session, kind, next_id_, withheld_}), timeout)) withheld_ = 0;
  }

  const PlayConfig& config_;
  wire::FrameSink& sink_;
  wire::Encoder encoder_;
  std::uint64_t next_id_ = 0;
  std::uint64_t withheld_ = 0;  // of the ids just below next_id_, not yet reported
  Clock::time_point last_message_{};
  PlayTally tally_;
};

}  // namespace

PlayTally play(const std::vector<EncodedCloud>& clouds, const PlayConfig& config, wire::FrameSink& sink,
               const std::function<bool()>& stop, const std::function<void(std::uint64_t)>& progress) {
  const auto begin = Clock::now();
  FrameSender sender(config, sink);
  for (std::uint64_t id = 0; config.rounds == 0 || id < config.rounds * clouds.size(); ++id) {
    if (config.due_ns.empty()) {
      sender.wait_for_room(stop);
    } else {
      sender.sleep_until(begin + due_time(config, id, clouds.size()), stop);
    }
    if (stop()) break;
    sender.send(clouds[id % clouds.size()]);
    progress(id + 1);
  }
  PlayTally tally = sender.finish();
  tally.seconds = std::chrono::duration<double>(Clock::now() - begin).count();
  return tally;
}

}  // namespace lbea::tool
