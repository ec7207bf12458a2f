#include "tools/serve/announcer.hpp"

#include <algorithm>

namespace lbea::tool {
namespace {
constexpr std::uint64_t most_announced = 1000;  // of one gap; the rest is only counted
}

void Announcer::refuse(wire::WireStatus status, const wire::FrameHeader& header, std::int64_t receive_ns) noexcept {
  handover_.counters.count(status);
  if (header.identified || stray_limit_.allows(RateLimit::Clock::now())) {
    announce(status, header, receive_ns);
  } else {
    handover_.counters.count_unannounced();
  }
}

void Announcer::announce(wire::WireStatus status, std::uint64_t session, IdRange ids,
                         std::int64_t receive_ns) noexcept {
  const std::uint64_t announced = std::min(ids.count, most_announced);
  wire::FrameHeader header;
  header.session = session;
  for (header.id = ids.first; header.id - ids.first < announced; ++header.id) announce(status, header, receive_ns);
  if (ids.count > announced) handover_.counters.count_unannounced(ids.count - announced);
}

void Announcer::announce(wire::WireStatus status, const wire::FrameHeader& header, std::int64_t receive_ns) noexcept {
  wire::WireResult* refusal = handover_.refusals.claim();
  if (refusal == nullptr) {
    handover_.counters.count_unannounced();
    return;
  }
  *refusal = {};
  refusal->session = header.session;
  refusal->frame_id = header.id;
  refusal->stamp_ns = header.stamp_ns;
  refusal->points.received = header.points;
  refusal->status = status;
  refusal->receive_ns = receive_ns;
  handover_.refusals.publish();
  handover_.result_bell.ring();
}

}  // namespace lbea::tool
