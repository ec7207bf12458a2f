// lbea-send: sends point clouds from files to a matcher, as a camera does.
#include "adapters/clouds/point_cloud.hpp"
#include "tools/send/player.hpp"
#include "tools/shared/cli/cloud_files.hpp"
#include "tools/shared/cli/progress.hpp"
#include "tools/shared/cli/tool.hpp"
#include "tools/shared/intake/access_options.hpp"
#include "tools/shared/intake/handshake.hpp"

#include <nlohmann/json.hpp>

#include <cstdio>

namespace lbea::tool {
namespace {

struct Options {
  std::vector<std::string> paths;
  std::filesystem::path stamps;
  std::string endpoint, results_endpoint, columns, frame_id = "sensor";
  double rate_hz = 0;
  bool realtime = false, wait_ready = false, json = false;
  PlayConfig play;
  ClientAccessOptions access;
};

constexpr auto description =
    "Sends point clouds from files (--list-formats) as frames. All clouds are read and encoded before the first one is "
    "sent.\n"
    "With --rate or --realtime a frame without room at the receiver is refused and counted, because a camera cannot\n"
    "wait; otherwise sending waits. With --results sending starts after the matcher has registered this session, and\n"
    "at the end the matcher reports what arrived. The exit code is 1 when a frame was refused, did not leave this\n"
    "program or, with --results, did not arrive or had no room in the matcher's queue.";
constexpr auto max_wait = std::chrono::milliseconds(5000);

void add_options(Tool& tool, Options& options) {
  tool.add_option("paths", options.paths, "files, or folders of them, sent in the order of their names")->required();
  tool.add_option("--to", options.endpoint, "endpoint of the matcher's frames, e.g. ipc:///tmp/frames.ipc")->required();
  tool.add_option("--results", options.results_endpoint,
                  "endpoint of the matcher's results: register before the start and compare counts at the end");
  auto* rate = tool.add_option("--rate", options.rate_hz, "frames per second")->check(in_range(1e-3, 1e6));
  tool.add_flag("--realtime", options.realtime, "pace by the clouds' stamps")->excludes(rate);
  tool.add_option(
      "--stamps", options.stamps,
      "table of file,stamp_ns (or _us, _ms, _s) with capture times (default: stamps.csv beside the clouds)");
  add_columns_option(tool, options.columns);
  tool.add_option("--loop", options.play.rounds, "how often to send all of them; 0: until stopped")
      ->check(in_range(0, 1'000'000));
  tool.add_option("--frame-id", options.frame_id, "name of the points' coordinate system");
  tool.add_flag("--end-of-stream,!--open-end", options.play.ends_stream,
                "mark the end of the test after the last frame");
  tool.add_flag("--wait-ready", options.wait_ready, "wait for the receiver without limit instead of 5 s");
  options.access.add_to(tool);
  tool.add_flag("--json", options.json, "print the closing tally as JSON");
}

void wait_for_receiver(wire::FrameSink& sink, const Options& options) {
  const auto deadline = std::chrono::steady_clock::now() + max_wait;
  while (stop_requested == 0 && !sink.wait_ready(std::chrono::milliseconds(50))) {
    if (options.wait_ready || std::chrono::steady_clock::now() < deadline) continue;
    throw Error{
        Status::endpoint_unavailable,
        "endpoint \"" + options.endpoint +
            "\": nobody listens there, or nobody who knows this program's key; start lbea-serve with --frames " +
            options.endpoint + ", or use --wait-ready"};
  }
}

/// The sender's own tally, and the matcher's receipt with --results.
struct Account {
  PlayTally tally;
  std::optional<Receipt> receipt;
};

std::string tally_json(const Account& account) {
  const PlayTally& tally = account.tally;
  nlohmann::ordered_json json{{"captured", tally.captured},
                              {"sent", tally.sent},
                              {"refused", tally.refused},
                              {"handed_over", tally.handed_over},
                              {"seconds", tally.seconds}};
  if (account.receipt && account.receipt->is_whole) json["receipt"] = receipt_json(*account.receipt);
  return json.dump();
}

std::string tally_line(const Account& account) {
  const PlayTally& tally = account.tally;
  char seconds[32];
  std::snprintf(seconds, sizeof seconds, "%.3f", tally.seconds);
  return "captured " + std::to_string(tally.captured) + " = sent " + std::to_string(tally.sent) + " + refused " +
         std::to_string(tally.refused) + "; handed over " + (tally.handed_over < tally.sent ? "at least " : "") +
         std::to_string(tally.handed_over) + " in " + seconds + " s" +
         (account.receipt ? receipt_text(*account.receipt) : "");
}

std::vector<EncodedCloud> load(const Options& options) {
  const auto files = find_clouds(options.paths);
  Progress progress("reading", files.size());
  return encode_clouds(files, options.stamps, options.columns, options.play.session, options.frame_id,
                       [&](std::size_t done) { progress.advance_to(done); });
}

bool is_complete(const Account& account, std::uint64_t planned) {
  const PlayTally& tally = account.tally;
  if (tally.handed_over != tally.captured || tally.captured < planned) return false;
  return !account.receipt ||
         (account.receipt->is_whole && account.receipt->received == tally.captured && account.receipt->dropped == 0);
}

int send(Options options) {
  catch_stop_signals();
  const auto stop = [] { return stop_requested != 0; };
  options.play.session = wire::new_session();
  wire::WireContext context;
  const wire::ClientAccess access = options.access.load();
  wire::FrameSink sink(context, options.endpoint, wire::default_queued_messages, access);
  const auto clouds = load(options);
  if (options.realtime) options.play.due_ns = schedule_by_stamps(clouds);
  if (options.rate_hz > 0) options.play.due_ns = schedule_by_rate(clouds.size(), options.rate_hz);
  std::optional<Handshake> handshake;
  if (!options.results_endpoint.empty())
    handshake.emplace(sink, wire::ResultSource(context, options.results_endpoint, wire::results_held, access),
                      options.play.session);
  wait_for_receiver(sink, options);
  std::optional<Receipts> receipts;
  if (handshake) {
    const wire::WireState state = handshake->begin(stop).value_or(wire::WireState{});
    options.play.max_message_bytes = state.max_message_bytes;
    receipts.emplace(state);
  }
  const std::uint64_t planned = options.play.rounds * clouds.size();
  Account account;
  {
    Progress progress("sending", planned);
    account.tally = play(clouds, options.play, sink, stop, [&](std::uint64_t done) { progress.advance_to(done); });
  }
  if (handshake) {
    receipts->collect(*handshake, options.play.session, account.tally.captured);
    account.receipt = receipts->sum();
  }
  std::printf("%s\n", (options.json ? tally_json(account) : tally_line(account)).c_str());
  return is_complete(account, planned) ? exit_ok : exit_failed;
}

}  // namespace
}  // namespace lbea::tool

int main(int argc, char** argv) {
  lbea::tool::Options options;
  lbea::tool::Tool tool("lbea-send", lbea::tool::description,
                        "lbea-send frames/ --to ipc:///tmp/frames.ipc --rate 1000 --wait-ready");
  lbea::tool::add_options(tool, options);
  tool.list_formats_by(lbea::io::list_cloud_formats());
  return tool.run(argc, argv, [&] { return lbea::tool::send(options); });
}
