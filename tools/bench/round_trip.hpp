// From the camera to the result: through sockets, another process and back.
#pragma once

#include "tools/bench/measurement.hpp"

#include <functional>
#include <span>
#include <string>
#include <vector>

namespace lbea::tool::bench {

/// Of a running lbea-serve.
struct Endpoints {
  std::string frames, results;
};

/// "FRAMES,RESULTS". Throws Error{bad_config}.
[[nodiscard]] Endpoints parse_endpoints(const std::string& both);

/// Microseconds from the call that sends a frame, encoded before, to its result being here. One frame at a time, the
/// clouds in turn. Throws Error{endpoint_unavailable} when nobody takes frames or answers within five seconds.
[[nodiscard]] std::vector<double> round_trips(const Endpoints& endpoints, std::span<const BenchCloud> clouds,
                                              const Schedule& schedule,
                                              const std::function<void(std::uint64_t done)>& progress);

}  // namespace lbea::tool::bench
