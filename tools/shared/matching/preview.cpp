#include "tools/shared/matching/preview.hpp"

#include "tools/shared/matching/transformed.hpp"

#include <algorithm>
#include <cmath>

namespace lbea::tool {
namespace {

constexpr int clouds_held = 2;  // per subscriber; older ones are of no use

bool is_finite(const Point& p) noexcept { return std::isfinite(p.x) && std::isfinite(p.y) && std::isfinite(p.z); }

}  // namespace

void thin(std::vector<Point>& points, std::uint32_t max_points, const RigidTransform& T_to_from) {
  const std::size_t count = points.size(), wanted = std::min<std::size_t>(count, max_points);
  std::size_t kept = 0;
  for (std::size_t i = 0; i < wanted; ++i) {
    const Point point = transformed(T_to_from, points[i * count / wanted]);
    if (is_finite(point)) points[kept++] = point;
  }
  points.resize(kept);
}

Preview::Preview(wire::WireContext& context, const std::string& endpoint, const PreviewConfig& config)
    : config_(config),
      sink_(context, endpoint, clouds_held, config.access),
      last_(config.T_reference_sensor.size()),
      decoder_(config.limits) {
  waiting_.reserve(std::size_t{config.limits.max_points} * sizeof(Point) + 4096);
  points_.reserve(config.limits.max_points);
  thread_ = std::thread(&Preview::run, this);
}

Preview::~Preview() {
  {
    const std::lock_guard lock(mutex_);
    stopping_ = true;
  }
  wake_.notify_one();
  thread_.join();
}

void Preview::frame(wire::Message message, const wire::FrameHeader& header, const Arrival& arrival) noexcept {
  const auto now = Clock::now();
  if (header.end_of_stream || header.cloud.empty() || now - last_[arrival.rig] < config_.interval) return;
  const std::unique_lock lock(mutex_, std::try_to_lock);
  if (!lock || has_waiting_ || message.size() > waiting_.capacity()) return;
  // A message beyond the capacity has too many or very wide points; nothing is allocated for it.
  waiting_.assign(message.begin(), message.end());
  waiting_rig_ = arrival.rig;
  has_waiting_ = true;
  last_[arrival.rig] = now;
  wake_.notify_one();
}

void Preview::run() noexcept {
  std::vector<std::byte> message;
  message.reserve(waiting_.capacity());
  std::unique_lock lock(mutex_);
  while (true) {
    wake_.wait(lock, [&] { return has_waiting_ || stopping_; });
    if (stopping_) return;
    message.swap(waiting_);
    has_waiting_ = false;
    const std::uint32_t rig = waiting_rig_;
    lock.unlock();
    publish(message, rig);
    lock.lock();
  }
}

void Preview::publish(wire::Message message, std::uint32_t rig) {
  if (decoder_.open(message) != wire::WireStatus::ok) return;
  const wire::FrameHeader& header = decoder_.header();
  points_.resize(header.points);
  decoder_.read_points(points_);
  thin(points_, config_.max_points, config_.T_reference_sensor[rig]);
  sink_.send(encoder_.frame({header.id, header.stamp_ns, points_}, header.session, "reference"));
}

}  // namespace lbea::tool
