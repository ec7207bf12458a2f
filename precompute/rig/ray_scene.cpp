#include "precompute/rig/ray_scene.hpp"

#include <embree3/rtcore.h>

#include <algorithm>
#include <new>

namespace lbea::bake {
namespace {
void check(RTCDevice device) {
  const RTCError error = rtcGetDeviceError(device);
  if (error == RTC_ERROR_NONE) return;
  if (error == RTC_ERROR_OUT_OF_MEMORY) throw std::bad_alloc();
  throw Error{Status::bad_config, "ray casting failed (Embree error " + std::to_string(error) + ")"};
}

template <class Item>
void fill_buffer(RTCDevice device, RTCGeometry geometry, RTCBufferType type, RTCFormat format,
                 std::span<const Item> items) {
  void* buffer = rtcSetNewGeometryBuffer(geometry, type, 0, format, sizeof(Item), items.size());
  check(device);
  std::copy(items.begin(), items.end(), static_cast<Item*>(buffer));
}

RTCRay make_ray(const Vec3& origin, const Vec3& direction, float far) {
  RTCRay ray{};
  ray.org_x = static_cast<float>(origin.x);
  ray.org_y = static_cast<float>(origin.y);
  ray.org_z = static_cast<float>(origin.z);
  ray.dir_x = static_cast<float>(direction.x);
  ray.dir_y = static_cast<float>(direction.y);
  ray.dir_z = static_cast<float>(direction.z);
  ray.tfar = far;
  ray.mask = std::numeric_limits<unsigned>::max();
  return ray;
}
}  // namespace

struct RayDevice::Handle {
  // One thread: the tree over the triangles, and with it the answer at shared edges, comes out the same every
  // time; a component's mesh is built in milliseconds anyway.
  RTCDevice device = rtcNewDevice("threads=1");
  Handle() = default;
  Handle(const Handle&) = delete;
  Handle& operator=(const Handle&) = delete;
  ~Handle() {
    if (device != nullptr) rtcReleaseDevice(device);
  }
};

RayDevice::RayDevice() : handle_(std::make_unique<Handle>()) {
  if (handle_->device == nullptr) check(nullptr);
}
RayDevice::~RayDevice() = default;

struct RayScene::Handle {
  RTCScene scene;
  explicit Handle(RTCDevice device) : scene(rtcNewScene(device)) { check(device); }
  Handle(const Handle&) = delete;
  Handle& operator=(const Handle&) = delete;
  ~Handle() { rtcReleaseScene(scene); }
};

RayScene::RayScene(const RayDevice& owner, std::span<const float> positions,
                   std::span<const std::array<std::uint32_t, 3>> triangles)
    : handle_(std::make_unique<Handle>(owner.handle_->device)) {
  const RTCDevice device = owner.handle_->device;
  const RTCScene scene = handle_->scene;
  rtcSetSceneFlags(scene, RTC_SCENE_FLAG_ROBUST);  // no ray slips through between two triangles
  if (!triangles.empty()) {
    using Corner = std::array<float, 3>;
    const std::unique_ptr<RTCGeometryTy, void (*)(RTCGeometry)> geometry(
        rtcNewGeometry(device, RTC_GEOMETRY_TYPE_TRIANGLE), rtcReleaseGeometry);
    check(device);
    const std::span corners(reinterpret_cast<const Corner*>(positions.data()), positions.size() / 3);
    fill_buffer<Corner>(device, geometry.get(), RTC_BUFFER_TYPE_VERTEX, RTC_FORMAT_FLOAT3, corners);
    fill_buffer(device, geometry.get(), RTC_BUFFER_TYPE_INDEX, RTC_FORMAT_UINT3, triangles);
    rtcCommitGeometry(geometry.get());
    rtcAttachGeometry(scene, geometry.get());
  }
  rtcCommitScene(scene);
  check(device);
}

RayScene::~RayScene() = default;

std::optional<RayHit> RayScene::first_hit(const Vec3& origin, const Vec3& direction) const {
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  RTCRayHit query{make_ray(origin, direction, std::numeric_limits<float>::infinity()), {}};
  query.hit.geomID = RTC_INVALID_GEOMETRY_ID;
  rtcIntersect1(handle_->scene, &context, &query);
  if (query.hit.geomID == RTC_INVALID_GEOMETRY_ID) return std::nullopt;
  return RayHit{query.ray.tfar, query.hit.primID, {query.hit.Ng_x, query.hit.Ng_y, query.hit.Ng_z}};
}

bool RayScene::blocked(const Vec3& eye, const Vec3& point, double tolerance) const {
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  RTCRay ray = make_ray(eye, point - eye, static_cast<float>(1 - tolerance));
  rtcOccluded1(handle_->scene, &context, &ray);
  return ray.tfar < 0;  // Embree's answer: minus infinity
}
}  // namespace lbea::bake
