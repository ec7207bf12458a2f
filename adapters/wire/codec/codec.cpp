// What concerns all messages, and the codecs of frame, control and inference.
#include "adapters/wire/codec/codec.hpp"

#include "PointCloud_bfbs_generated.h"
#include "adapters/wire/codec/flatbuffer.hpp"
#include "control_generated.h"
#include "frame_bfbs_generated.h"
#include "frame_generated.h"
#include "inference_generated.h"
#include "result_bfbs_generated.h"
#include "result_generated.h"
#include "state_bfbs_generated.h"
#include "state_generated.h"

#include <algorithm>

namespace lbea::wire {
namespace {
constexpr std::int64_t ns_per_s = 1'000'000'000;
constexpr flatbuffers::uoffset_t max_frame_tables = 64;
constexpr std::size_t float_bytes = sizeof(float);
constexpr std::size_t max_header_bytes = 65'536;  // of a message, apart from its points
constexpr std::array<std::string_view, 3> axis_names{"x", "y", "z"};
constexpr std::size_t max_control_bytes = 256;
constexpr flatbuffers::uoffset_t max_control_tables = 2;
constexpr detail::MessageLimits inference_limits{64 << 20, 2};

template <class Schema>
std::span<const std::byte> bytes_of() noexcept {
  return std::as_bytes(std::span{Schema::data(), Schema::size()});
}

std::vector<float> values(const flatbuffers::Vector<float>* from) {
  return from == nullptr ? std::vector<float>() : std::vector<float>(from->begin(), from->end());
}

bool is_identity(const foxglove::Pose* pose) {
  if (pose == nullptr) return true;
  const auto* position = pose->position();
  const auto* rotation = pose->orientation();
  const bool at_origin = position == nullptr || (position->x() == 0 && position->y() == 0 && position->z() == 0);
  return at_origin && (rotation == nullptr || (rotation->x() == 0 && rotation->y() == 0 && rotation->z() == 0));
}

/// The byte offsets of x, y and z within a point.
WireStatus find_axes(const foxglove::PointCloud& cloud, std::array<std::size_t, 3>& offsets) {
  std::array<bool, 3> found{};
  if (cloud.fields() == nullptr) return WireStatus::bad_fields;
  for (const auto* field : *cloud.fields()) {
    if (field->name() == nullptr) continue;
    const auto axis = std::find(axis_names.begin(), axis_names.end(), field->name()->string_view());
    if (axis == axis_names.end()) continue;
    const auto k = static_cast<std::size_t>(axis - axis_names.begin());
    if (found[k] || field->type() != foxglove::NumericType::FLOAT32) return WireStatus::bad_fields;
    found[k] = true;
    offsets[k] = field->offset();
    const std::size_t stride = cloud.point_stride();
    if (stride < float_bytes || offsets[k] > stride - float_bytes) return WireStatus::bad_layout;
  }
  return found[0] && found[1] && found[2] ? WireStatus::ok : WireStatus::bad_fields;
}

bool to_stamp(const foxglove::Time* time, std::int64_t& stamp_ns) {
  stamp_ns = 0;
  if (time == nullptr) return true;
  if (time->nsec() >= ns_per_s) return false;
  stamp_ns = std::int64_t{time->sec()} * ns_per_s + time->nsec();
  return true;
}

foxglove::Time to_time(std::int64_t stamp_ns) {
  return {static_cast<std::uint32_t>(stamp_ns / ns_per_s), static_cast<std::uint32_t>(stamp_ns % ns_per_s)};
}

flatbuffers::Offset<flatbuffers::Vector<flatbuffers::Offset<foxglove::PackedElementField>>> axis_fields(
    flatbuffers::FlatBufferBuilder& builder) {
  std::array<flatbuffers::Offset<foxglove::PackedElementField>, 3> fields;
  for (std::size_t k = 0; k < 3; ++k) {
    const auto name = builder.CreateString(axis_names[k].data(), axis_names[k].size());
    fields[k] = foxglove::CreatePackedElementField(builder, name, static_cast<std::uint32_t>(k * float_bytes),
                                                   foxglove::NumericType::FLOAT32);
  }
  return builder.CreateVector(fields.data(), fields.size());
}

void build_cloud(flatbuffers::FlatBufferBuilder& builder, const Frame& frame, std::string_view frame_id) {
  std::uint8_t* into = nullptr;
  const auto data = builder.CreateUninitializedVector(frame.points.size_bytes(), 1, &into);
  if (!frame.points.empty()) std::memcpy(into, frame.points.data(), frame.points.size_bytes());
  const auto fields = axis_fields(builder);
  const auto name = builder.CreateString(frame_id.data(), frame_id.size());
  const foxglove::Time time = to_time(frame.stamp_ns);
  builder.Finish(foxglove::CreatePointCloud(builder, &time, name, 0, sizeof(Point), fields, data));
}
}  // namespace

std::span<const std::byte> point_cloud_schema() noexcept { return bytes_of<foxglove::PointCloudBinarySchema>(); }
std::span<const std::byte> frame_schema() noexcept { return bytes_of<schema::FrameBinarySchema>(); }
std::span<const std::byte> result_schema() noexcept { return bytes_of<schema::ResultBinarySchema>(); }
std::span<const std::byte> state_schema() noexcept { return bytes_of<schema::StateBinarySchema>(); }

MessageKind message_kind(std::span<const std::byte> message) noexcept {
  if (detail::has_identifier(message, schema::FrameIdentifier())) return MessageKind::frame;
  if (detail::has_identifier(message, schema::ResultIdentifier())) return MessageKind::result;
  if (detail::has_identifier(message, schema::StateIdentifier())) return MessageKind::state;
  if (detail::has_identifier(message, schema::ControlIdentifier())) return MessageKind::control;
  if (detail::has_identifier(message, schema::InferenceIdentifier())) return MessageKind::inference;
  return MessageKind::unknown;
}

Encoder::Encoder() : buffers_(std::make_unique<Buffers>()) {}
Encoder::~Encoder() = default;
Encoder::Encoder(Encoder&&) noexcept = default;
Encoder& Encoder::operator=(Encoder&&) noexcept = default;

WireStatus FrameDecoder::open(std::span<const std::byte> message) {
  header_ = {};
  const std::size_t most_bytes = std::min(limits_.max_message_bytes(), detail::max_flatbuffer_bytes);
  const auto [frame, status] =
      detail::open<schema::Frame>(message, schema::FrameIdentifier(), {most_bytes, max_frame_tables}, message_);
  if (frame == nullptr) return status;
  header_.session = frame->session();
  header_.id = frame->id();
  header_.identified = true;
  header_.end_of_stream = frame->end_of_stream();
  if (header_.end_of_stream) return WireStatus::end_of_stream;
  if (frame->cloud() == nullptr) return WireStatus::bad_cloud;
  return open_cloud(std::as_bytes(std::span{frame->cloud()->data(), frame->cloud()->size()}));
}

WireStatus FrameDecoder::open_cloud(std::span<const std::byte> bytes) {
  const auto* cloud = detail::verified_root<foxglove::PointCloud>(detail::aligned(bytes, cloud_), max_frame_tables);
  if (cloud == nullptr) return WireStatus::bad_cloud;
  header_.cloud = bytes;
  if (!to_stamp(cloud->timestamp(), header_.stamp_ns)) return WireStatus::bad_stamp;
  if (cloud->frame_id() != nullptr) header_.frame_id = cloud->frame_id()->string_view();
  if (!is_identity(cloud->pose())) return WireStatus::unsupported_pose;
  if (const WireStatus status = find_axes(*cloud, offsets_); status != WireStatus::ok) return status;
  stride_ = cloud->point_stride();
  data_ = {};
  if (cloud->data() != nullptr) data_ = std::as_bytes(std::span{cloud->data()->data(), cloud->data()->size()});
  if (data_.size() % stride_ != 0) return WireStatus::bad_layout;
  if (data_.size() / stride_ > limits_.max_points) return WireStatus::too_many_points;
  header_.points = static_cast<std::uint32_t>(data_.size() / stride_);
  return WireStatus::ok;
}

void FrameDecoder::read_points(std::span<Point> into) const noexcept {
  const std::size_t count = std::min<std::size_t>(header_.points, into.size());
  if (count == 0) return;
  if (stride_ == sizeof(Point) && offsets_ == std::array<std::size_t, 3>{0, 4, 8}) {
    std::memcpy(into.data(), data_.data(), count * sizeof(Point));
    return;
  }
  for (std::size_t i = 0; i < count; ++i) {
    const std::byte* point = data_.data() + i * stride_;
    std::memcpy(&into[i].x, point + offsets_[0], float_bytes);
    std::memcpy(&into[i].y, point + offsets_[1], float_bytes);
    std::memcpy(&into[i].z, point + offsets_[2], float_bytes);
  }
}

WireStatus decode_frame(std::span<const std::byte> message, DecodedFrame& into, WireLimits limits) {
  FrameDecoder decoder(limits);
  const WireStatus status = decoder.open(message);
  into.header = decoder.header();
  into.coordinate_system = into.header.frame_id;
  into.header.frame_id = {};
  into.header.cloud = {};
  into.points.resize(status == WireStatus::ok ? into.header.points : 0);
  decoder.read_points(into.points);
  return status;
}

std::span<const std::byte> Encoder::frame(const Frame& frame, std::uint64_t session, std::string_view frame_id) {
  if (!is_sendable_stamp(frame.stamp_ns) || !is_sendable_count(frame.points.size()) ||
      frame_id.size() > max_header_bytes)
    return {};
  auto& cloud = buffers_->cloud;
  cloud.Clear();
  build_cloud(cloud, frame, frame_id);
  return frame_of_cloud(detail::finished(cloud), session, frame.id);
}

std::span<const std::byte> Encoder::frame_of_cloud(std::span<const std::byte> cloud, std::uint64_t session,
                                                   std::uint64_t id) {
  if (cloud.size() > detail::max_flatbuffer_bytes - max_header_bytes) return {};
  auto& message = buffers_->cleared();
  message.ForceDefaults(true);  // relabel_frame needs the field also when the id is 0
  message.ForceVectorAlignment(cloud.size(), 1, detail::flatbuffer_alignment);
  const auto nested = message.CreateVector(reinterpret_cast<const std::uint8_t*>(cloud.data()), cloud.size());
  schema::FinishFrameBuffer(message, schema::CreateFrame(message, session, id, nested));
  return detail::finished(message);
}

std::span<const std::byte> Encoder::end_of_stream(std::uint64_t session, std::uint64_t next_id) {
  auto& message = buffers_->cleared();
  schema::FinishFrameBuffer(message, schema::CreateFrame(message, session, next_id, 0, true));
  return detail::finished(message);
}

void relabel_frame(std::span<std::byte> message, std::uint64_t id, std::int64_t stamp_ns) noexcept {
  auto* frame = flatbuffers::GetMutableRoot<schema::Frame>(message.data());
  frame->mutate_id(id);
  auto* cloud = flatbuffers::GetMutableRoot<foxglove::PointCloud>(frame->mutable_cloud()->data());
  *cloud->mutable_timestamp() = to_time(stamp_ns);
}

bool is_sendable_stamp(std::int64_t stamp_ns) noexcept {
  return stamp_ns >= 0 && stamp_ns / ns_per_s <= std::numeric_limits<std::uint32_t>::max();
}

bool is_sendable_count(std::size_t points) noexcept {
  return points <= (detail::max_flatbuffer_bytes - 2 * max_header_bytes) / sizeof(Point);
}

std::span<const std::byte> Encoder::control(const Control& control) {
  auto& builder = buffers_->cleared();
  schema::FinishControlBuffer(
      builder, schema::CreateControl(builder, control.session, static_cast<schema::ControlKind>(control.kind),
                                     control.next_id, control.withheld));
  return detail::finished(builder);
}

WireStatus decode_control(std::span<const std::byte> message, Control& into) {
  if (message.size() > max_control_bytes) return WireStatus::message_too_large;
  if (!detail::has_identifier(message, schema::ControlIdentifier())) return WireStatus::wrong_kind;
  std::array<std::uint64_t, max_control_bytes / sizeof(std::uint64_t)> aligned;
  std::memcpy(aligned.data(), message.data(), message.size());
  const auto* from = detail::verified_root<schema::Control>(std::as_bytes(std::span{aligned}).first(message.size()),
                                                            max_control_tables);
  if (from == nullptr || from->kind() > schema::ControlKind::MAX || from->withheld() > from->next_id())
    return WireStatus::damaged;
  into = {from->session(), static_cast<ControlKind>(from->kind()), from->next_id(), from->withheld()};
  return WireStatus::ok;
}

std::span<const std::byte> Encoder::inference(const WireInference& inference) {
  auto& builder = buffers_->cleared();
  const auto field = builder.CreateString(inference.field), unit = builder.CreateString(inference.unit);
  const auto mean = builder.CreateVector(inference.values), spread = builder.CreateVector(inference.spread);
  const auto bound = inference.bound_90.empty() ? 0 : builder.CreateVector(inference.bound_90);
  const auto component = inference.component.empty() ? 0 : builder.CreateString(inference.component);
  schema::FinishInferenceBuffer(
      builder,
      schema::CreateInference(builder, inference.sequence, inference.session, inference.frame_id, inference.stamp_ns,
                              field, unit, static_cast<schema::FieldLocation>(inference.location), mean, spread,
                              inference.model_checksum, bound, component));
  return detail::finished(builder);
}

WireStatus decode_inference(std::span<const std::byte> message, WireInference& into) {
  std::vector<std::uint64_t> scratch;
  const auto [from, status] =
      detail::open<schema::Inference>(message, schema::InferenceIdentifier(), inference_limits, scratch);
  if (from == nullptr) return status;
  if (from->location() > schema::FieldLocation::MAX) return WireStatus::damaged;
  const auto location = static_cast<FieldInfo::Location>(from->location());
  into = {from->sequence(),
          from->session(),
          from->frame_id(),
          from->stamp_ns(),
          detail::text(from->field()),
          detail::text(from->unit()),
          location,
          values(from->values()),
          values(from->spread()),
          from->model_checksum(),
          values(from->bound_90()),
          detail::text(from->component())};
  const bool has_bounds = !into.bound_90.empty();
  return into.spread.size() == into.values.size() && (!has_bounds || into.bound_90.size() == into.values.size())
             ? WireStatus::ok
             : WireStatus::damaged;
}
}  // namespace lbea::wire
