#include "tools/replay/witness.hpp"

#include "adapters/wire/codec/codec.hpp"

#include <spdlog/spdlog.h>

namespace lbea::tool {
namespace {

using Clock = std::chrono::steady_clock;
constexpr std::chrono::milliseconds longest_silence{5000}, look_interval{50};

std::optional<wire::WireState> first_state(wire::ResultSource& results, const std::function<bool()>& stop) {
  wire::WireState state;
  for (const auto deadline = Clock::now() + longest_silence; !stop() && Clock::now() < deadline;) {
    const auto message = results.receive(look_interval);
    if (message && wire::message_kind(*message) == wire::MessageKind::state &&
        wire::decode_state(*message, state) == wire::WireStatus::ok)
      return state;
  }
  return {};
}

}  // namespace

MatcherWitness::MatcherWitness(wire::WireContext& context, const std::string& results_endpoint,
                               const wire::ClientAccess& access, const std::function<bool()>& stop)
    : context_(context), endpoint_(results_endpoint), access_(access) {
  wire::ResultSource source = results();
  auto state = first_state(source, stop);
  if (!state)
    throw Error(
        Status::endpoint_unavailable,
        "endpoint \"" + endpoint_ + "\": no matcher publishes its results there; give that of lbea-serve's --results");
  receipts_.emplace(std::move(*state));
}

void MatcherWitness::ask(wire::FrameSink& frames, std::uint64_t session, std::uint64_t next_id) {
  Handshake handshake(frames, results(), session);
  receipts_->collect(handshake, session, next_id);
  if (receipts_->knew(session))
    spdlog::warn("the matcher had frames of session {:016x} before, and refuses ids that come again; start it anew",
                 session);
}

}  // namespace lbea::tool
