#include "tools/send/player.hpp"

#include "adapters/clouds/point_cloud.hpp"
#include "adapters/wire/codec/codec.hpp"

#include <algorithm>
#include <atomic>
#include <map>
#include <thread>

namespace lbea::tool {

namespace fs = std::filesystem;

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

/// The tables of capture times, each read once.
class StampTables {
 public:
  explicit StampTables(fs::path given) : given_(std::move(given)) {}

  std::optional<std::int64_t> of(const fs::path& file, std::optional<std::int64_t> in_file) {
    const fs::path table = given_.empty() ? file.parent_path() / io::stamp_table_name : given_;
    if (given_.empty() && !fs::exists(table)) return io::CloudStamps().of(file, in_file);
    return tables_.try_emplace(table, table).first->second.of(file, in_file);
  }

 private:
  fs::path given_;
  std::map<fs::path, io::CloudStamps> tables_;
};

}  // namespace

std::vector<EncodedCloud> encode_clouds(const std::vector<fs::path>& files, const fs::path& stamps,
                                        const std::string& columns, std::uint64_t session, const std::string& frame_id,
                                        const std::function<void(std::size_t)>& progress) {
  std::vector<EncodedCloud> clouds;
  wire::Encoder encoder;
  StampTables tables(stamps);
  for (const fs::path& file : files) {
    io::PointCloud cloud = io::read_point_cloud(file, columns);
    cloud.stamp_ns = tables.of(file, cloud.stamp_ns);
    const auto message = encoder.frame({0, cloud.stamp_ns.value_or(0), cloud.points}, session, frame_id);
    if (message.empty())
      throw Error{Status::bad_input, file.string() +
                                         ": its stamp is before 1970 or after 2106, or it is larger than the 2 GB of a "
                                         "message; it cannot be sent"};
    clouds.push_back({file, std::make_shared<std::vector<std::byte>>(message.begin(), message.end()), cloud.stamp_ns});
    progress(clouds.size());
  }
  return clouds;
}

std::vector<std::int64_t> schedule_by_stamps(const std::vector<EncodedCloud>& clouds) {
  std::vector<std::int64_t> due;
  for (const EncodedCloud& cloud : clouds) {
    if (!cloud.stamp_ns)
      throw Error{Status::bad_input,
                  cloud.file.string() + ": has no stamp to pace by; use --rate instead of --realtime"};
    due.push_back(*cloud.stamp_ns - *clouds.front().stamp_ns);
    if (due.size() > 1 && due.back() < due[due.size() - 2])
      throw Error{Status::bad_input, cloud.file.string() +
                                         ": its stamp is before that of the cloud sent before it; give the files in "
                                         "the order of their stamps, or use --rate"};
  }
  const auto intervals = static_cast<std::int64_t>(due.size()) - 1;
  due.push_back(intervals > 0 ? due.back() + due.back() / intervals : 0);
  return due;
}

std::vector<std::int64_t> schedule_by_rate(std::size_t clouds, double rate_hz) {
  std::vector<std::int64_t> due;
  for (std::size_t i = 0; i <= clouds; ++i)
    due.push_back(static_cast<std::int64_t>(1e9 * static_cast<double>(i) / rate_hz));
  return due;
}

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
