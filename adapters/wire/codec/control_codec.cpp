#include "adapters/wire/codec/codec.hpp"

#include "adapters/wire/codec/encoder_buffers.hpp"
#include "adapters/wire/codec/verified.hpp"
#include "control_generated.h"

namespace lbea::wire {
namespace {
constexpr std::size_t max_control_bytes = 256;
constexpr flatbuffers::uoffset_t max_control_tables = 2;
}  // namespace

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

}  // namespace lbea::wire
