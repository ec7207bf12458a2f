// The C interface to senders of frames.
#include "adapters/wire/c_api/c_support.hpp"
#include "adapters/wire/codec/codec.hpp"
#include "adapters/wire/sockets/client.hpp"

using namespace lbea;
using namespace lbea::wire;

struct lbea_wire_sender {
  lbea_wire_sender(std::string address, const OpenOptions& options)
      : endpoint(std::move(address)), sink(context, endpoint, options.queued_messages, options.access) {}
  std::string endpoint;
  WireContext context;
  FrameSink sink;
  std::optional<FrameSender> sender;  // from the matcher's admission on
};

namespace lbea::wire {
namespace {
static_assert(sizeof(lbea_wire_status) == 4, "enums are four bytes wide");
constexpr std::size_t least_tally = offsetof(lbea_wire_tally, handed_over) + sizeof(std::uint64_t);

lbea_wire_tally to_c(const SendTally& tally, std::uint64_t session) noexcept {
  return {.struct_size = 0,
          .session = session,
          .captured = tally.captured,
          .sent = tally.sent,
          .refused = tally.refused,
          .handed_over = tally.handed_over};
}

lbea_wire_status no_room(lbea_wire_sender& s) {
  const Link link = s.sender->link();
  if (link != Link::admitted) return failed(LBEA_WIRE_NO_ROOM, explain(link, s.endpoint, "--frames"));
  return failed(LBEA_WIRE_NO_ROOM,
                "endpoint \"" + s.endpoint + "\": the matcher's queue is full; send fewer frames or wait longer");
}

lbea_wire_status refused(lbea_wire_sender& s, std::size_t point_count, std::int64_t stamp_ns) {
  if (!is_sendable_stamp(stamp_ns))
    return failed(LBEA_WIRE_BAD_STAMP, "stamp_ns " + std::to_string(stamp_ns) +
                                           " is before 1970 or after 2106; give the capture time in ns since 1970");
  if (!is_sendable_count(point_count))
    return failed(LBEA_WIRE_TOO_LARGE, std::to_string(point_count) + " points exceed a message (2 GB); thin the cloud");
  return no_room(s);
}

lbea_wire_status send(lbea_wire_sender& s, std::span<const Point> points, std::int64_t stamp_ns,
                      std::uint32_t timeout_ms) {
  try {
    if (s.sender->send(points, stamp_ns, to_ms(timeout_ms))) return LBEA_WIRE_OK;
  } catch (const std::bad_alloc&) {
    s.sender->send(nullptr);
    throw;
  }
  return refused(s, points.size(), stamp_ns);
}
}  // namespace
}  // namespace lbea::wire

lbea_wire_status lbea_wire_sender_open(const char* endpoint, const lbea_wire_options* options,
                                       lbea_wire_sender** sender) {
  if (sender == nullptr) return bad_argument("lbea_wire_sender_open: sender is NULL; give the address of a pointer");
  *sender = nullptr;
  if (endpoint == nullptr) return bad_argument("lbea_wire_sender_open: endpoint is NULL; give that of --frames");
  if (!has_known_size(options)) return bad_argument(size_not_set);
  return guarded([&] {
    refuse_own_process(endpoint);
    const OpenOptions given = read_options(options, default_queued_messages);
    auto opened = std::make_unique<lbea_wire_sender>(endpoint, given);
    if (!wait_admitted(opened->sink, given.patience))
      return not_connected(opened->sink.link(), opened->endpoint, "--frames");
    opened->sender.emplace(opened->sink, new_session());
    *sender = opened.release();
    return LBEA_WIRE_OK;
  });
}

lbea_wire_status lbea_wire_sender_send(lbea_wire_sender* sender, const float* xyz, size_t point_count, int64_t stamp_ns,
                                       uint32_t timeout_ms, uint64_t* frame_id) {
  if (sender == nullptr) return bad_argument("lbea_wire_sender_send: sender is NULL; open one first");
  if (xyz == nullptr && point_count > 0) return bad_argument("lbea_wire_sender_send: xyz is NULL");
  if (frame_id != nullptr) *frame_id = sender->sender->next_id();
  const std::span points(reinterpret_cast<const Point*>(xyz), point_count);
  return guarded([&] { return send(*sender, points, stamp_ns, timeout_ms); });
}

lbea_wire_status lbea_wire_sender_withhold(lbea_wire_sender* sender, uint64_t* frame_id) {
  if (sender == nullptr) return bad_argument("lbea_wire_sender_withhold: sender is NULL; open one first");
  if (frame_id != nullptr) *frame_id = sender->sender->next_id();
  return guarded([&] {
    sender->sender->send(nullptr);
    return LBEA_WIRE_OK;
  });
}

lbea_wire_status lbea_wire_sender_end_test(lbea_wire_sender* sender) {
  if (sender == nullptr) return bad_argument("lbea_wire_sender_end_test: sender is NULL; open one first");
  return guarded([&] { return sender->sender->end_stream() ? LBEA_WIRE_OK : no_room(*sender); });
}

lbea_wire_status lbea_wire_sender_get_tally(const lbea_wire_sender* sender, lbea_wire_tally* tally) {
  if (sender == nullptr || tally == nullptr) return bad_argument("lbea_wire_sender_get_tally: sender or tally is NULL");
  return guarded(
      [&] { return write_out(to_c(sender->sender->tally(), sender->sender->session()), tally, least_tally); });
}

lbea_wire_status lbea_wire_sender_close(lbea_wire_sender* sender, lbea_wire_tally* tally) {
  if (sender == nullptr) return bad_argument("lbea_wire_sender_close: sender is NULL");
  if (tally != nullptr && !is_plausible_size(tally->struct_size, least_tally)) return bad_argument(size_not_set);
  const std::unique_ptr<lbea_wire_sender> owned(sender);
  return guarded([&] {
    const SendTally found = owned->sender->finish();
    if (tally != nullptr) write_c_struct(to_c(found, owned->sender->session()), tally);
    if (found.handed_over == found.sent) return LBEA_WIRE_OK;
    return failed(LBEA_WIRE_UNDELIVERED,
                  "endpoint \"" + owned->endpoint + "\": " + std::to_string(found.sent - found.handed_over) + " of " +
                      std::to_string(found.sent) + " frames sent were not handed over; the matcher has ended or does " +
                      "not read");
  });
}
