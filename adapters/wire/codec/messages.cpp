#include "adapters/wire/codec/messages.hpp"

namespace lbea::wire {
namespace {
struct StatusText {
  std::string_view name;
  Fate fate;
  std::string_view sentence;
};

constexpr std::array<StatusText, wire_status_count> status_texts{{
    {"ok", Fate::matched, "matched"},
    {"low_coverage", Fate::matched, "matched, but too little of the surface was seen to trust it"},
    {"empty_frame", Fate::rejected,
     "no finite point inside the ensemble's envelope; check the sensor's pose and its field of view"},
    {"too_many_points", Fate::rejected, "more points than --max-points of the matcher; raise it or thin the cloud"},
    {"message_too_large", Fate::rejected, "more bytes than the largest allowed frame"},
    {"wrong_kind", Fate::rejected,
     "the message's file identifier is not one for this socket; check what the sender is connected to"},
    {"damaged", Fate::rejected,
     "the message is truncated, an offset points outside it, or its id is 2^32 or more beyond the last one"},
    {"bad_cloud", Fate::rejected, "the frame holds no valid foxglove.PointCloud"},
    {"bad_layout", Fate::rejected, "the cloud's point_stride does not divide its data or a field exceeds the stride"},
    {"bad_fields", Fate::rejected, "the cloud needs exactly one float32 field for each of x, y and z"},
    {"bad_stamp", Fate::rejected, "the stamp is before 1970, after 2106, or has 1,000,000,000 ns or more"},
    {"unsupported_pose", Fate::rejected, "the cloud has a pose; send points in sensor coordinates, without one"},
    {"queue_full", Fate::dropped, "the queue was full of earlier frames; raise --queue or send fewer frames"},
    {"end_of_stream", Fate::not_a_capture, "the sender marked the end of the test"},
    {"missed", Fate::dropped,
     "later ids arrived, this one did not: the connection broke, or the message was over the size limit"},
    {"withheld", Fate::dropped, "the sender captured it and had no room to send it; send fewer frames"},
    {"duplicate", Fate::rejected, "a frame with this id arrived before; give every capture its own id"},
    {"other_sender", Fate::dropped,
     "the test of another sender is running (--one-sender); stop one of the two, or wait for the other's goodbye"},
    {"out_of_step", Fate::dropped,
     "its stamp differs from those of the other rigs' frames: it arrived after later ones were matched, or the rig's "
     "clock differs; raise --wait-us, synchronize the clocks, or give --clock-offset-ns"},
}};

constexpr StatusText unknown_text{"unknown_status", Fate::not_a_capture, "a status that this version does not know"};

const StatusText& text_of(WireStatus status) noexcept {
  const auto index = static_cast<std::size_t>(status);
  return index < status_texts.size() ? status_texts[index] : unknown_text;
}

/// names: in the order of the enumerators.
template <class Enum>
std::string_view name_of(Enum value, std::initializer_list<std::string_view> names, std::string_view unknown) noexcept {
  const auto index = static_cast<std::size_t>(value);
  return index < names.size() ? names.begin()[index] : unknown;
}
}  // namespace

std::string_view to_string(WireStatus status) noexcept { return text_of(status).name; }
std::string_view explain(WireStatus status) noexcept { return text_of(status).sentence; }
Fate fate_of(WireStatus status) noexcept { return text_of(status).fate; }

std::string_view to_string(WireVerdict verdict) noexcept {
  return name_of(verdict, {"unknown", "matched", "low_coverage", "refused", "ambiguous", "no_simulation_fits"},
                 "unknown_verdict");
}

std::string_view to_string(RecordingPhase phase) noexcept {
  return name_of(phase, {"armed", "recording", "finished", "failed"}, "unknown_phase");
}

std::string_view to_string(Fate fate) noexcept {
  return name_of(fate, {"matched", "rejected", "dropped", "not_a_capture"}, "unknown_fate");
}

Counters& Counters::operator+=(const Counters& more) noexcept {
  for (std::size_t i = 0; i < wire_status_count; ++i) by_status[i] += more.by_status[i];
  received += more.received;
  missed += more.missed;
  duplicates += more.duplicates;
  reordered += more.reordered;
  sessions += more.sessions;
  silent += more.silent;
  interleaved += more.interleaved;
  unannounced += more.unannounced;
  recorded += more.recorded;
  unrecorded += more.unrecorded;
  return *this;
}

std::uint64_t Counters::sum(Fate fate) const noexcept {
  std::uint64_t total = 0;
  for (std::size_t i = 0; i < by_status.size(); ++i) {
    if (status_texts[i].fate == fate) total += by_status[i];
  }
  return total;
}
}  // namespace lbea::wire
