// Publishes thinned clouds for viewers at a limited rate, on its own socket and thread.
#pragma once

#include "tools/shared/intake/run_observer.hpp"

#include <chrono>
#include <condition_variable>
#include <mutex>
#include <thread>

namespace lbea::tool {

struct PreviewConfig {
  wire::WireLimits limits;
  RigidTransform T_reference_sensor = identity_transform;
  std::uint32_t max_points = 20'000;
  std::chrono::milliseconds interval{33};  // minimum time between two clouds
  wire::ServerAccess access;
};

class Preview final : public RunObserver {
 public:
  /// Binds. Throws Error{endpoint_unavailable}. Clouds are published as frames in reference coordinates.
  Preview(wire::WireContext& context, const std::string& endpoint, const PreviewConfig& config);
  ~Preview() override;

  /// Copies at most one message per interval, and none while the previous copy is being published.
  void frame(wire::Message message, const wire::FrameHeader& header, std::int64_t receive_ns) noexcept override;
  [[nodiscard]] const std::string& endpoint() const noexcept { return sink_.endpoint(); }
  [[nodiscard]] wire::ResultSink& sink() noexcept { return sink_; }  // for its peers

 private:
  using Clock = std::chrono::steady_clock;
  void run() noexcept;
  void publish(wire::Message message);

  PreviewConfig config_;
  wire::ResultSink sink_;
  Clock::time_point last_{};    // receiving thread
  wire::FrameDecoder decoder_;  // from here on: publishing thread
  wire::Encoder encoder_;
  std::vector<Point> points_;
  std::mutex mutex_;  // guards the members below
  std::condition_variable wake_;
  std::vector<std::byte> waiting_;
  bool has_waiting_ = false, stopping_ = false;
  std::thread thread_;
};

/// Keeps at most `max_points` of the points, evenly spaced in their order, transformed by `T_to_from`, without points
/// that are not finite.
void thin(std::vector<Point>& points, std::uint32_t max_points, const RigidTransform& T_to_from);

}  // namespace lbea::tool
