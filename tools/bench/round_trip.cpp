#include "tools/bench/round_trip.hpp"

#include "adapters/wire/codec.hpp"
#include "adapters/wire/streams.hpp"

#include <lbea/lbea.hpp>

#include <chrono>
#include <random>

namespace lbea::bench {

namespace {

using Clock = std::chrono::steady_clock;
constexpr std::chrono::seconds patience{5};

using Encoded = std::vector<std::uint64_t>;  // 8-byte aligned

Encoded aligned_copy(Message message) {
  Encoded copy((message.size() + 7) / 8);
  std::ranges::copy(message, std::as_writable_bytes(std::span(copy)).begin());
  return copy;
}

std::vector<Encoded> encoded(std::span<const BenchCloud> clouds, std::uint64_t session, std::vector<std::size_t>& sizes) {
  Encoder encoder;
  std::vector<Encoded> messages;
  for (const BenchCloud& cloud : clouds) {
    const auto message = encoder.frame({0, cloud.frame().stamp_ns, cloud.points}, session);
    sizes.push_back(message.size());
    messages.push_back(aligned_copy(message));
  }
  return messages;
}

/// Until the matcher's state says that results can no longer be missed.
void wait_for_state(ResultSource& results, const Endpoints& endpoints) {
  for (const auto begin = Clock::now(); Clock::now() - begin < patience;)
    if (const auto message = results.receive(std::chrono::milliseconds(100)); message && message_kind(*message) == MessageKind::state) return;
  throw Error(Status::endpoint_unavailable, endpoints.results + ": nobody publishes there; start lbea-serve");
}

void wait_for_result(ResultSource& results, std::uint64_t session, std::uint64_t id, const Endpoints& endpoints) {
  for (const auto begin = Clock::now(); Clock::now() - begin < patience;) {
    const auto message = results.receive(std::chrono::milliseconds(100));
    WireResult result;
    if (message && decode_result(*message, result) == WireStatus::ok && result.session == session && result.frame_id == id) return;
  }
  throw Error(Status::endpoint_unavailable, endpoints.results + ": frame " + std::to_string(id) + " got no result");
}

}  // namespace

Endpoints parse_endpoints(const std::string& both) {
  const auto comma = both.find(',');
  if (comma == std::string::npos || comma == 0 || comma + 1 == both.size())
    throw Error(Status::bad_config, both + ": give the endpoints of a running lbea-serve as FRAMES,RESULTS");
  return {both.substr(0, comma), both.substr(comma + 1)};
}

std::vector<double> round_trips(const Endpoints& endpoints, std::span<const BenchCloud> clouds, const Schedule& schedule,
                                const std::function<void(std::uint64_t)>& progress) {
  const std::uint64_t session = std::random_device{}();
  std::vector<std::size_t> sizes;
  std::vector<Encoded> messages = encoded(clouds, session, sizes);
  WireContext context;
  FrameSink frames(context, endpoints.frames);
  ResultSource results(context, endpoints.results);
  if (!frames.wait_ready(patience)) throw Error(Status::endpoint_unavailable, endpoints.frames + ": nobody takes frames there; start lbea-serve");
  wait_for_state(results, endpoints);
  std::vector<double> times;
  for (std::uint64_t id = 0; id < std::uint64_t{schedule.warm_up} + schedule.frames; ++id) {
    const std::size_t cloud = id % clouds.size();
    const auto message = std::as_writable_bytes(std::span(messages[cloud])).first(sizes[cloud]);
    relabel_frame(message, id, clouds[cloud].frame().stamp_ns);
    const auto begin = Clock::now();
    if (!frames.send(message, patience)) throw Error(Status::endpoint_unavailable, endpoints.frames + ": no room for a frame within 5 s");
    wait_for_result(results, session, id, endpoints);
    if (id >= schedule.warm_up) times.push_back(std::chrono::duration<double, std::micro>(Clock::now() - begin).count());
    progress(id + 1);
  }
  return times;
}

}  // namespace lbea::bench
