#include "adapters/wire/codec/codec.hpp"

#include "adapters/wire/codec/encoder_buffers.hpp"
#include "adapters/wire/codec/verified.hpp"
#include "inference_generated.h"

namespace lbea::wire {
namespace {

using detail::text;

constexpr std::size_t max_inference_bytes = 64 << 20;
constexpr flatbuffers::uoffset_t max_inference_tables = 2;

std::vector<float> values(const flatbuffers::Vector<float>* from) {
  return from == nullptr ? std::vector<float>() : std::vector<float>(from->begin(), from->end());
}

}  // namespace

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
          text(from->field()),
          text(from->unit()),
          static_cast<FieldInfo::Location>(from->location()),
          values(from->values()),
          values(from->spread()),
          from->model_checksum()};
  return into.spread.size() == into.values.size() ? WireStatus::ok : WireStatus::damaged;
}

}  // namespace lbea::wire
