#include "tools/replay/rig_outlet.hpp"

#include "tools/replay/pace.hpp"
#include "tools/shared/cli/tool.hpp"
#include "tools/shared/intake/log.hpp"
#include "tools/shared/text/formatted.hpp"

#include <nlohmann/json.hpp>

namespace lbea::tool {
namespace {

using namespace std::chrono_literals;
using Clock = std::chrono::steady_clock;

constexpr auto longest_wait = 5s;  // for the receiver, and for a matcher's state

std::string counts_text(const SocketCounts& counts) {
  const auto number = [](std::uint64_t value) -> unsigned long long { return value; };
  return formatted("frames %llu = sent %llu + refused %llu; %llu not delivered", number(counts.sent + counts.refused),
                   number(counts.sent), number(counts.refused), number(counts.left));
}

nlohmann::ordered_json counts_json(const SocketCounts& counts) {
  return {{"frames", counts.sent + counts.refused},
          {"sent", counts.sent},
          {"refused", counts.refused},
          {"left", counts.left}};
}

}  // namespace

std::vector<RigOutlet> connected(wire::WireContext& context, const std::vector<RigEndpoint>& endpoints,
                                 const wire::ClientAccess& access) {
  std::vector<RigOutlet> outlets;
  for (const auto& [rig, endpoint] : endpoints)
    outlets.push_back({rig, wire::FrameSink(context, endpoint, wire::default_queued_messages, access)});
  const auto deadline = Clock::now() + longest_wait;
  for (std::size_t i = 0; i < outlets.size(); ++i)
    while (!outlets[i].sink.wait_ready(Pace::stop_interval))
      if (stop_requested != 0 || Clock::now() > deadline)
        throw Error(Status::endpoint_unavailable, "endpoint \"" + endpoints[i].endpoint +
                                                      "\": no program listens there; start lbea-serve with --frames " +
                                                      (endpoints[i].name.empty() ? "" : endpoints[i].name + "=") +
                                                      endpoints[i].endpoint);
  return outlets;
}

MatcherReceipts::MatcherReceipts(wire::WireContext& context, const std::string& results_endpoint,
                                 const wire::ClientAccess& access)
    : context_(context), endpoint_(results_endpoint), access_(access) {
  wire::ResultSource source = results();
  auto state = wait_for_state(
      source, [deadline = Clock::now() + longest_wait] { return stop_requested != 0 || Clock::now() >= deadline; });
  if (!state)
    throw Error(Status::endpoint_unavailable,
                "endpoint \"" + endpoint_ +
                    "\": no matcher publishes results there; give the endpoint of lbea-serve --results");
  receipts_.emplace(std::move(*state));
}

std::uint64_t MatcherReceipts::ask(wire::FrameSink& frames, std::uint64_t session, std::uint64_t next_id) {
  Handshake handshake(frames, results(), session);
  const std::uint64_t before = receipts_->sum().received;
  receipts_->collect(handshake, session, next_id);
  if (receipts_->knew(session))
    log_warning("the matcher had frames of session {:016x} before and refuses repeated ids; restart the matcher",
                session);
  return receipts_->sum().received - before;
}

bool MatcherReceipts::await_end(wire::FrameSink& frames, std::uint64_t session, std::uint64_t next_id) {
  return Handshake(frames, results(), session).end(next_id, 0, longest_wait).has_value();
}

void SocketTally::add(const RigOutlet& outlet, std::uint64_t now_left) {
  Rig rig;
  rig.name = outlet.rig;
  rig.sent = outlet.sink.tally().sent;
  rig.refused = outlet.sink.tally().refused;
  rig.left = now_left;
  rig.repeated = outlet.ids.duplicates();
  rig.received = outlet.received;
  sent += rig.sent;
  refused += rig.refused;
  left += rig.left;
  repeated += rig.repeated;
  if (!rig.name.empty()) rigs.push_back(rig);
}

std::string to_text(const SocketTally& tally) {
  std::string text = counts_text(tally) +
                     formatted("; %.3f s, largest delay %.3f ms", tally.seconds, tally.worst_lateness_ms) +
                     (tally.receipt ? receipt_text(*tally.receipt) : "");
  const bool has_receipt = tally.receipt && tally.receipt->is_whole;
  for (const SocketTally::Rig& rig : tally.rigs)
    text += "\n" + rig.name + ": " + counts_text(rig) +
            (has_receipt ? "; the matcher has received " + std::to_string(rig.received) : "");
  return text;
}

std::string to_json(const SocketTally& tally) {
  nlohmann::ordered_json json = counts_json(tally);
  json["seconds"] = tally.seconds;
  json["worst_lateness_ms"] = tally.worst_lateness_ms;
  const bool has_receipt = tally.receipt && tally.receipt->is_whole;
  if (has_receipt) json["receipt"] = receipt_json(*tally.receipt);
  for (const SocketTally::Rig& rig : tally.rigs) {
    nlohmann::ordered_json& of_rig = json["rigs"][rig.name] = counts_json(rig);
    if (has_receipt) of_rig["received"] = rig.received;
  }
  return json.dump();
}

}  // namespace lbea::tool
