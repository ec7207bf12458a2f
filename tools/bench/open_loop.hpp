// What a rig sees that does not wait: frames at fixed times, whatever became of the ones before.
#pragma once

#include "tools/bench/round_trip.hpp"
#include "tools/bench/statistics.hpp"

#include <cstdint>
#include <functional>
#include <span>
#include <string>
#include <vector>

namespace lbea::tool::bench {

/// How many values up to a bound, and above the bound before.
struct Bucket {
  double up_to = 0;
  std::size_t count = 0;
};
/// Bounds are powers of the square root of 2, from the first that is not empty to the last.
[[nodiscard]] std::vector<Bucket> histogram_of(std::span<const double> values);

struct OpenLoop {
  std::uint64_t sent = 0, refused = 0;  // refused: no room between here and the matcher
  std::uint64_t matched = 0, lost = 0;  // of those sent; lost: no result, or one that says it was not matched
  double seconds = 0;  // from when the first frame was due until the last one was, or its result was here
  /// Microseconds from when a frame was due, not from when it could be sent: a stall counts for every frame that it
  /// held up.
  std::vector<double> since_due;
};

/// Sends frames `1 / rate` seconds apart, the clouds in turn. Throws Error{endpoint_unavailable} as round_trips().
[[nodiscard]] OpenLoop open_loop(const Endpoints& endpoints, std::span<const BenchCloud> clouds,
                                 const Schedule& schedule, double rate,
                                 const std::function<void(std::uint64_t done)>& progress);

[[nodiscard]] std::string to_text(const OpenLoop& run);
[[nodiscard]] std::string to_json(const OpenLoop& run);

}  // namespace lbea::tool::bench
