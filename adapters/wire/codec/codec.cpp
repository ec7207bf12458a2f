// What concerns all messages, and the codecs of the small ones: control and inference.
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

namespace lbea::wire {
namespace {

constexpr std::size_t max_control_bytes = 256;
constexpr flatbuffers::uoffset_t max_control_tables = 2;
constexpr std::size_t max_inference_bytes = 64 << 20;
constexpr flatbuffers::uoffset_t max_inference_tables = 2;

template <class Schema>
std::span<const std::byte> bytes_of() noexcept {
  return std::as_bytes(std::span{Schema::data(), Schema::size()});
}

std::vector<float> values(const flatbuffers::Vector<float>* from) {
  return from == nullptr ? std::vector<float>() : std::vector<float>(from->begin(), from->end());
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

std::span<const std::byte> Encoder::control(const Control& control) {
  auto& builder = buffers_->message;
  builder.Clear();
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
  auto& builder = buffers_->message;
  builder.Clear();
  const auto field = builder.CreateString(inference.field), unit = builder.CreateString(inference.unit);
  const auto mean = builder.CreateVector(inference.values), spread = builder.CreateVector(inference.spread);
  schema::FinishInferenceBuffer(builder, schema::CreateInference(builder, inference.sequence, inference.session,
                                                                 inference.frame_id, inference.stamp_ns, field, unit,
                                                                 static_cast<schema::FieldLocation>(inference.location),
                                                                 mean, spread, inference.model_checksum));
  return detail::finished(builder);
}

WireStatus decode_inference(std::span<const std::byte> message, WireInference& into) {
  if (message.size() > max_inference_bytes) return WireStatus::message_too_large;
  if (!detail::has_identifier(message, schema::InferenceIdentifier())) return WireStatus::wrong_kind;
  std::vector<std::uint64_t> scratch;
  const auto* from = detail::verified_root<schema::Inference>(detail::aligned(message, scratch), max_inference_tables);
  if (from == nullptr || from->location() > schema::FieldLocation::MAX) return WireStatus::damaged;
  into = {from->sequence(),
          from->session(),
          from->frame_id(),
          from->stamp_ns(),
          detail::text(from->field()),
          detail::text(from->unit()),
          static_cast<FieldInfo::Location>(from->location()),
          values(from->values()),
          values(from->spread()),
          from->model_checksum()};
  return into.spread.size() == into.values.size() ? WireStatus::ok : WireStatus::damaged;
}

}  // namespace lbea::wire
