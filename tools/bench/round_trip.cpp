#include "tools/bench/round_trip.hpp"

#include "tools/bench/sending.hpp"

#include <lbea/lbea.hpp>

namespace lbea::tool::bench {
namespace {

void wait_for_result(wire::ResultSource& results, std::uint64_t session, std::uint64_t id, const Endpoints& endpoints) {
  for (const auto begin = Clock::now(); Clock::now() - begin < patience;) {
    const auto message = results.receive(std::chrono::milliseconds(100));
    wire::WireResult result;
    if (message && wire::decode_result(*message, result) == wire::WireStatus::ok && result.session == session &&
        result.frame_id == id)
      return;
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

std::vector<double> round_trips(const Endpoints& endpoints, std::span<const BenchCloud> clouds,
                                const Schedule& schedule, const std::function<void(std::uint64_t)>& progress) {
  Sending sending(endpoints, clouds);
  std::vector<double> times;
  for (std::uint64_t id = 0; id < std::uint64_t{schedule.warm_up} + schedule.frames; ++id) {
    const auto begin = Clock::now();
    if (!sending.send(id, patience))
      throw Error(Status::endpoint_unavailable, endpoints.frames + ": no room for a frame within 5 s");
    wait_for_result(sending.results(), sending.session(), id, endpoints);
    if (id >= schedule.warm_up)
      times.push_back(std::chrono::duration<double, std::micro>(Clock::now() - begin).count());
    progress(id + 1);
  }
  return times;
}

}  // namespace lbea::tool::bench
