// Publishes thinned clouds of each rig for viewers at a limited rate, on its own socket and thread.
#pragma once

#include "tools/shared/intake/run_observer.hpp"

#include <chrono>
#include <condition_variable>
#include <mutex>
#include <thread>

namespace lbea::tool {

struct PreviewConfig {
  wire::WireLimits limits;
  std::vector<RigidTransform> T_reference_sensor{identity_transform};  // of each rig
  std::uint32_t max_points = 20'000;
  std::chrono::milliseconds interval{33};  // minimum time between two clouds
  wire::ServerAccess access;
};

class Preview final : public RunObserver {
 public:
  /// Binds. Throws Error{endpoint_unavailable}. Clouds are published as frames in reference coordinates.
  Preview(wire::WireContext& context, const std::string& endpoint, const PreviewConfig& config);
  ~Preview() override;

  /// Copies at most one message per rig and interval, and none while the previous copy is being published.
  void frame(wire::Message message, const wire::FrameHeader& header, const Arrival& arrival) noexcept override;
  [[nodiscard]] const std::string& endpoint() const noexcept { return sink_.endpoint(); }
  [[nodiscard]] wire::ResultSink& sink() noexcept { return sink_; }  // for its peers

 private:
  using Clock = std::chrono::steady_clock;
  void run() noexcept;
  void publish(wire::Message message, std::uint32_t rig);

  PreviewConfig config_;
  wire::ResultSink sink_;
  std::vector<Clock::time_point> last_;  // of each rig; receiving thread
  wire::FrameDecoder decoder_;           // from here on: publishing thread
  wire::Encoder encoder_;
  std::vector<Point> points_;
  std::mutex mutex_;  // guards the members below
  std::condition_variable wake_;
  std::vector<std::byte> waiting_;
  std::uint32_t waiting_rig_ = 0;
  bool has_waiting_ = false, stopping_ = false;
  std::thread thread_;
};

/// Keeps at most `max_points` of the points, evenly spaced in their order, transformed by `T_to_from`, without points
/// that are not finite.
void thin(std::vector<Point>& points, std::uint32_t max_points, const RigidTransform& T_to_from);

}  // namespace lbea::tool
