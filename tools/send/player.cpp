#include "tools/send/player.hpp"

#include "adapters/clouds/point_cloud.hpp"
#include "adapters/wire/codec/codec.hpp"
#include "adapters/wire/sockets/client.hpp"
#include "tools/shared/cli/cloud_files.hpp"
#include "tools/shared/cli/progress.hpp"
#include "tools/shared/cli/tool.hpp"
#include "tools/shared/intake/handshake.hpp"
#include "tools/shared/text/formatted.hpp"

#include <nlohmann/json.hpp>

#include <algorithm>
#include <atomic>
#include <map>
#include <thread>

namespace lbea::tool {
namespace {

namespace fs = std::filesystem;
using namespace std::chrono_literals;
using Clock = std::chrono::steady_clock;

constexpr auto max_wait = 5s;         // for the receiver
constexpr auto stop_interval = 50ms;  // maximum delay until a stop is noticed

struct EncodedCloud {
  fs::path file;
  std::shared_ptr<std::vector<std::byte>> message;
  std::optional<std::int64_t> stamp_ns;  // none without one in table, file or file name
};

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

/// Throws Error{bad_input} when only some clouds have a capture time: the others would get the time of sending.
void check_clocks(const std::vector<EncodedCloud>& clouds) {
  const auto is_unstamped = [](const EncodedCloud& cloud) { return !cloud.stamp_ns; };
  const auto without = std::ranges::find_if(clouds, is_unstamped);
  if (without == clouds.end()) return;
  if (!std::ranges::all_of(clouds, is_unstamped))
    throw Error{Status::bad_input, without->file.string() +
                                       ": has no capture time, but other clouds have one; add it, or give a table "
                                       "(--stamps)"};
  std::fprintf(stderr,
               "lbea-send: warning: the clouds have no capture times; their frames get the time of sending, and "
               "matching uses the times of a test (see --stamps)\n");
}

/// Reads and encodes. Stamps come from the table of the options or, without one, from stamps.csv beside the clouds;
/// otherwise from the clouds, otherwise from their file names.
std::vector<EncodedCloud> encode_clouds(const SendOptions& options, std::uint64_t session) {
  const auto files = find_clouds(options.paths);
  Progress progress("reading", files.size());
  std::vector<EncodedCloud> clouds;
  wire::Encoder encoder;
  StampTables tables(options.stamps);
  for (const fs::path& file : files) {
    io::PointCloud cloud = io::read_point_cloud(file, options.columns);
    cloud.stamp_ns = tables.of(file, cloud.stamp_ns);
    const auto message = encoder.frame({0, cloud.stamp_ns.value_or(0), cloud.points}, session, options.frame_id);
    if (message.empty())
      throw Error{Status::bad_input, file.string() +
                                         ": its stamp is before 1970 or after 2106, or it is larger than the 2 GB of a "
                                         "message; it cannot be sent"};
    clouds.push_back({file, std::make_shared<std::vector<std::byte>>(message.begin(), message.end()), cloud.stamp_ns});
    progress.advance_to(clouds.size());
  }
  check_clocks(clouds);
  return clouds;
}

/// Due times by the clouds' stamps, in ns after the first cloud: one per cloud, then one for the second round's first.
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

/// Stamps from `begin_ns` on. All clouds have one.
void shift_stamps(std::vector<EncodedCloud>& clouds, std::int64_t begin_ns) {
  const std::int64_t shift_ns = begin_ns - *clouds.front().stamp_ns;
  for (EncodedCloud& cloud : clouds) *cloud.stamp_ns += shift_ns;
}

std::vector<std::int64_t> schedule_by_rate(std::size_t clouds, double rate_hz) {
  std::vector<std::int64_t> due;
  for (std::size_t i = 0; i <= clouds; ++i)
    due.push_back(static_cast<std::int64_t>(1e9 * static_cast<double>(i) / rate_hz));
  return due;
}

/// Waits until a frame is due. `due_ns`: as schedule_by_stamps() gives it.
void wait_until_due(const std::vector<std::int64_t>& due_ns, Clock::time_point begin, std::uint64_t frame) {
  constexpr double latest = 4e18;  // 127 years; the clock would overflow far beyond it
  const std::size_t clouds = due_ns.size() - 1;
  const double rounds_ns = static_cast<double>(frame / clouds) * static_cast<double>(due_ns.back());
  const double after_ns = std::min(rounds_ns + static_cast<double>(due_ns[frame % clouds]), latest);
  const auto due = begin + std::chrono::nanoseconds(static_cast<std::int64_t>(after_ns));
  while (stop_requested == 0 && Clock::now() < due)
    std::this_thread::sleep_until(std::min(due, Clock::now() + stop_interval));
}

/// The sender's own tally, and the matcher's receipt with --results.
struct Account {
  wire::SendTally tally;
  double seconds = 0;
  std::optional<Receipt> receipt;
};

void wait_for_receiver(wire::FrameSink& sink, const SendOptions& options) {
  const auto deadline = Clock::now() + max_wait;
  while (stop_requested == 0 && !sink.wait_ready(stop_interval)) {
    if (options.wait_ready || Clock::now() < deadline) continue;
    throw Error{
        Status::endpoint_unavailable,
        "endpoint \"" + options.endpoint +
            "\": nobody listens there, or nobody who knows this program's key; start lbea-serve with --frames " +
            options.endpoint + ", or use --wait-ready"};
  }
}

std::string to_json(const Account& account) {
  const wire::SendTally& tally = account.tally;
  nlohmann::ordered_json json{{"captured", tally.captured},
                              {"sent", tally.sent},
                              {"refused", tally.refused},
                              {"handed_over", tally.handed_over},
                              {"seconds", account.seconds}};
  if (account.receipt && account.receipt->is_whole) json["receipt"] = receipt_json(*account.receipt);
  return json.dump();
}

std::string to_text(const Account& account) {
  const wire::SendTally& tally = account.tally;
  return "captured " + std::to_string(tally.captured) + " = sent " + std::to_string(tally.sent) + " + refused " +
         std::to_string(tally.refused) + "; handed over " + (tally.handed_over < tally.sent ? "at least " : "") +
         std::to_string(tally.handed_over) + formatted(" in %.3f s", account.seconds) +
         (account.receipt ? receipt_text(*account.receipt) : "");
}

bool is_complete(const Account& account, std::uint64_t planned) {
  const wire::SendTally& tally = account.tally;
  return tally.handed_over == tally.captured && tally.captured >= planned &&
         (!account.receipt ||
          (account.receipt->is_whole && account.receipt->received == tally.captured && account.receipt->dropped == 0));
}

/// Whether the stamps begin anew with this frame, so that it belongs to another test than the one before it.
bool is_repetition(const std::vector<EncodedCloud>& clouds, std::uint64_t id) {
  return id > 0 && id % clouds.size() == 0 && clouds.front().stamp_ns;
}

/// `due_ns`: empty to send as fast as the receiver accepts. `max_message_bytes`: larger messages would break the
/// connection; 0: unknown.
Account play(const std::vector<EncodedCloud>& clouds, const std::vector<std::int64_t>& due_ns,
             const SendOptions& options, std::uint64_t session, std::uint64_t max_message_bytes,
             wire::FrameSink& sink) {
  const std::uint64_t planned = options.rounds * clouds.size();
  Progress progress("sending", planned);
  const std::int64_t now_ns = wire::system_clock_ns();
  const auto begin = Clock::now() + std::chrono::nanoseconds(options.begin_ns.value_or(now_ns) - now_ns);
  wire::FrameSender sender(sink, session);
  for (std::uint64_t id = 0; options.rounds == 0 || id < planned; ++id) {
    if (is_repetition(clouds, id) && options.ends_stream) sender.end_stream();
    if (!due_ns.empty()) wait_until_due(due_ns, begin, id);
    while (due_ns.empty() && stop_requested == 0 && !sender.wait_ready(stop_interval)) {}
    if (stop_requested != 0) break;
    const EncodedCloud& cloud = clouds[id % clouds.size()];
    const bool fits = max_message_bytes == 0 || cloud.message->size() <= max_message_bytes;
    sender.send(fits ? relabelled(cloud, id) : nullptr);
    progress.advance_to(id + 1);
  }
  if (options.ends_stream) sender.end_stream();
  Account account;
  account.tally = sender.finish();
  account.seconds = std::chrono::duration<double>(Clock::now() - begin).count();
  return account;
}

}  // namespace

int send(const SendOptions& options) {
  catch_stop_signals();
  const std::uint64_t session = wire::new_session();
  wire::WireContext context;
  const wire::ClientAccess access = options.access.load();
  wire::FrameSink sink(context, options.endpoint, wire::default_queued_messages, access);
  auto clouds = encode_clouds(options, session);
  std::vector<std::int64_t> due_ns;
  if (options.realtime) due_ns = schedule_by_stamps(clouds);
  if (options.begin_ns) shift_stamps(clouds, *options.begin_ns);
  if (options.rate_hz > 0) due_ns = schedule_by_rate(clouds.size(), options.rate_hz);
  std::optional<Handshake> handshake;
  if (!options.results_endpoint.empty())
    handshake.emplace(sink, wire::ResultSource(context, options.results_endpoint, wire::results_held, access), session);
  wait_for_receiver(sink, options);
  wire::WireState state;
  if (handshake) state = handshake->begin([] { return stop_requested != 0; }).value_or(wire::WireState{});
  Account account = play(clouds, due_ns, options, session, state.max_message_bytes, sink);
  if (handshake) {
    Receipts receipts(state);
    receipts.collect(*handshake, session, account.tally.captured);
    account.receipt = receipts.sum();
  }
  std::printf("%s\n", (options.json ? to_json(account) : to_text(account)).c_str());
  return is_complete(account, options.rounds * clouds.size()) ? exit_ok : exit_failed;
}

}  // namespace lbea::tool
