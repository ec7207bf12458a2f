#include "adapters/wire/access/door.hpp"

#include <new>
#include <utility>

namespace lbea::wire::detail {
namespace {

using namespace std::chrono_literals;

constexpr std::size_t most_visits = 64;
constexpr auto longest_handshake = 3s;  // ZeroMQ ends a connection that takes longer (see socket.cpp)
constexpr int all_failures =
    ZMQ_EVENT_HANDSHAKE_FAILED_NO_DETAIL | ZMQ_EVENT_HANDSHAKE_FAILED_PROTOCOL | ZMQ_EVENT_HANDSHAKE_FAILED_AUTH;

// A peer that is refused does not try again; one that is to come back does, once ZeroMQ has let go of it (RFC 27).
constexpr const char* welcome = "200";
constexpr const char* come_back = "300";

std::string decoded(const std::string& key) {
  std::string bytes(32, '\0');
  zmq_z85_decode(reinterpret_cast<std::uint8_t*>(bytes.data()), key.c_str());
  return bytes;
}

}  // namespace

Door::Door(std::string domain, const ServerAccess& access)
    : domain_(std::move(domain)), wants_keys_(access.keys.has_value()), max_peers_(access.max_peers) {
  for (const AllowedPeer& peer : access.allowed) names_.emplace(decoded(peer.public_key), peer.name);
}

PeerCounts Door::counts() const noexcept {
  const auto of = [](const Count& count) { return count.load(std::memory_order_relaxed); };
  return {of(open_), of(peers_), of(admitted_), of(unknown_), of(excess_), of(malformed_)};
}

const char* Door::answer(std::string_view mechanism, std::string_view key, std::string_view address) noexcept {
  using enum PeerVisit::Answer;
  const auto owner = wants_keys_ && mechanism == "CURVE" ? names_.find(key) : names_.end();
  if (wants_keys_ ? owner == names_.end() : mechanism != "NULL") {
    ++unknown_;
    note_visit(unknown, {}, address);
    return refused;
  }
  const std::string_view name = wants_keys_ ? std::string_view(owner->second) : std::string_view();
  if (peers_ >= max_peers_) {
    ++excess_;
    ++put_off_;
    note_visit(excess, name, address);
    return come_back;
  }
  note_visit(admitted, name, address);
  return welcome;
}

/// For want of memory a visit is only counted.
void Door::note_visit(PeerVisit::Answer answer, std::string_view name, std::string_view address) noexcept {
  const std::lock_guard lock(visits_mutex_);
  if (visits_.size() == most_visits) return;
  try {
    visits_.push_back({answer, std::string(name), std::string(address)});
  } catch (const std::bad_alloc&) {}
}

std::vector<PeerVisit> Door::visits() {
  const std::lock_guard lock(visits_mutex_);
  return std::exchange(visits_, {});
}

void Door::note(std::uint16_t event, std::int32_t value) {
  if (event == ZMQ_EVENT_ACCEPTED) {
    connections_[value] = Clock::now();
  } else if (event == ZMQ_EVENT_HANDSHAKE_SUCCEEDED) {
    ++peers_;
    ++admitted_;
  } else if (event == ZMQ_EVENT_DISCONNECTED) {
    note_end(value);
  }
  if (event == ZMQ_EVENT_HANDSHAKE_FAILED_NO_DETAIL && put_off_ > 0) {
    --put_off_;  // or a stranger left meanwhile: it is counted once either way
  } else if (event == ZMQ_EVENT_HANDSHAKE_FAILED_NO_DETAIL || event == ZMQ_EVENT_HANDSHAKE_FAILED_PROTOCOL) {
    ++malformed_;
  }
  failed_last_ = (event & all_failures) != 0;
  open_ = connections_.size();
}

// ZeroMQ does not say which connection succeeded. One that failed ends right after it is said to; what is not even
// ZeroMQ ends without a word and soon, when the handshake is still running; the others were peers.
void Door::note_end(std::int32_t descriptor) {
  const auto found = connections_.find(descriptor);
  if (found == connections_.end()) return;
  const bool is_young = Clock::now() - found->second < longest_handshake;
  const bool has_strangers = connections_.size() > peers_;
  connections_.erase(found);
  if (!failed_last_ && is_young && has_strangers) ++malformed_;
  const bool was_peer = !failed_last_ && !(is_young && has_strangers);
  if (was_peer && peers_ > 0) --peers_;
  if (peers_ > connections_.size()) peers_ = connections_.size();
}

}  // namespace lbea::wire::detail
