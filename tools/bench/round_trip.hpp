// Times frames on their way through a running lbea-serve and back: one at a time, or at a fixed rate.
#pragma once

#include "tools/bench/measurement.hpp"

#include <functional>

namespace lbea::tool::bench {

/// Endpoints of a running lbea-serve.
struct Endpoints {
  std::string frames, results;
};

/// Parses "FRAMES,RESULTS". Throws Error{bad_config}.
[[nodiscard]] Endpoints parse_endpoints(const std::string& both);

/// Microseconds from sending an encoded frame to receiving its result. Frames are sent one at a time, the clouds in
/// turn. Throws Error{endpoint_unavailable} when within five seconds no frame can be sent or no result arrives.
[[nodiscard]] std::vector<double> round_trips(const Endpoints& endpoints, std::span<const BenchCloud> clouds,
                                              const Schedule& schedule,
                                              const std::function<void(std::uint64_t done)>& progress);

/// Number of values up to this bound and above the previous one.
struct Bucket {
  double up_to = 0;
  std::size_t count = 0;
};
/// Bounds are powers of the square root of 2; the first and the last bucket are not empty.
[[nodiscard]] std::vector<Bucket> histogram_of(std::span<const double> values);

/// Result of an open loop: frames are sent at fixed times, independent of the results of earlier frames.
struct OpenLoop {
  std::uint64_t sent = 0, refused = 0;  // refused: the send queue was full
  std::uint64_t matched = 0, lost = 0;  // of those sent; lost: no result, or not matched
  double seconds = 0;                   // from the due time of the first frame to that of the last, or to its result
  /// Microseconds from the due time of each matched frame to its result. A stall counts for every frame it delays.
  std::vector<double> since_due;
};

/// Sends frames `1 / rate` seconds apart, the clouds in turn. Throws as round_trips() does.
[[nodiscard]] OpenLoop open_loop(const Endpoints& endpoints, std::span<const BenchCloud> clouds,
                                 const Schedule& schedule, double rate,
                                 const std::function<void(std::uint64_t done)>& progress);

[[nodiscard]] std::string to_text(const OpenLoop& run);
[[nodiscard]] std::string to_json(const OpenLoop& run);

}  // namespace lbea::tool::bench
