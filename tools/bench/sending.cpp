#include "tools/bench/sending.hpp"

#include <lbea/lbea.hpp>

#include <algorithm>
#include <random>

namespace lbea::tool::bench {
namespace {

/// Until the matcher's state says that results can no longer be missed.
void wait_for_state(wire::ResultSource& results, const Endpoints& endpoints) {
  for (const auto begin = Clock::now(); Clock::now() - begin < patience;)
    if (const auto message = results.receive(std::chrono::milliseconds(100));
        message && wire::message_kind(*message) == wire::MessageKind::state)
      return;
  throw Error(Status::endpoint_unavailable, endpoints.results + ": nobody publishes there; start lbea-serve");
}

}  // namespace

Sending::Sending(const Endpoints& endpoints, std::span<const BenchCloud> clouds)
    : session_(std::random_device{}()),
      clouds_(clouds),
      frames_(context_, endpoints.frames),
      results_(context_, endpoints.results) {
  wire::Encoder encoder;
  for (const BenchCloud& cloud : clouds) {
    const auto message = encoder.frame({0, cloud.frame().stamp_ns, cloud.points}, session_);
    sizes_.push_back(message.size());
    std::ranges::copy(message,
                      std::as_writable_bytes(std::span(messages_.emplace_back((message.size() + 7) / 8))).begin());
  }
  if (!frames_.wait_ready(patience))
    throw Error(Status::endpoint_unavailable, endpoints.frames + ": nobody takes frames there; start lbea-serve");
  wait_for_state(results_, endpoints);
}

bool Sending::send(std::uint64_t id, std::chrono::milliseconds timeout) {
  const std::size_t cloud = id % clouds_.size();
  const auto message = std::as_writable_bytes(std::span(messages_[cloud])).first(sizes_[cloud]);
  wire::relabel_frame(message, id, clouds_[cloud].frame().stamp_ns);
  return frames_.send(message, timeout);
}

}  // namespace lbea::tool::bench
