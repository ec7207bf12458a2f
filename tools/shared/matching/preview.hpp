// Now and then a thinned cloud for whoever watches: published beside the results, on a socket and a thread of its own.
#pragma once

#include "tools/shared/intake/run_observer.hpp"

#include <chrono>
#include <condition_variable>
#include <mutex>
#include <thread>
#include <vector>

namespace lbea::tool {

struct PreviewConfig {
  wire::WireLimits limits;
  RigidTransform T_reference_sensor = identity_transform;
  std::uint32_t max_points = 20'000;
  std::chrono::milliseconds interval{33};  // at the least, between two clouds
  wire::ServerAccess access;
};

class Preview final : public RunObserver {
 public:
  /// Binds. Throws Error{endpoint_unavailable}. Clouds go out as frames in the reference's coordinates.
  Preview(wire::WireContext& context, const std::string& endpoint, const PreviewConfig& config);
  ~Preview() override;

  /// Costs the receiving thread one copy per interval, and nothing while the last copy is still being published.
  void frame(wire::Message message, const wire::FrameHeader& header, std::int64_t receive_ns) noexcept override;
  void result(wire::Message, const wire::WireResult&) noexcept override {}
  void state(wire::Message, const wire::WireState&) noexcept override {}
  [[nodiscard]] Counts counts() const noexcept override { return {}; }
  [[nodiscard]] const std::string& endpoint() const noexcept { return sink_.endpoint(); }

 private:
  using Clock = std::chrono::steady_clock;
  void run() noexcept;
  void publish(wire::Message message);

  PreviewConfig config_;
  wire::ResultSink sink_;
  Clock::time_point last_{};    // the receiving thread's
  wire::FrameDecoder decoder_;  // the publishing thread's, like what follows
  wire::Encoder encoder_;
  std::vector<Point> points_;
  std::mutex mutex_;  // of the rest
  std::condition_variable wake_;
  std::vector<std::byte> waiting_;
  bool has_waiting_ = false, stopping_ = false;
  std::thread thread_;
};

/// At most `most` of the points, evenly over their order, moved by `T_to_from`; points that are not finite are left
/// out.
void thin(std::vector<Point>& points, std::uint32_t most, const RigidTransform& T_to_from);

}  // namespace lbea::tool
