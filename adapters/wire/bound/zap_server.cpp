#include "adapters/wire/bound/zap_server.hpp"

#include "adapters/wire/bound/addresses.hpp"

#include <algorithm>
#include <iterator>
#include <new>

namespace lbea::wire::detail {
namespace {
using namespace std::chrono_literals;

constexpr auto retry_delay = 10ms;  // after a failed allocation or a failed poll
constexpr std::size_t max_visits = 64;
constexpr std::size_t max_owners = 1024;
constexpr auto max_handshake = 3s;  // ZeroMQ ends a connection that takes longer (see socket.cpp)
constexpr int all_failures =
    ZMQ_EVENT_HANDSHAKE_FAILED_NO_DETAIL | ZMQ_EVENT_HANDSHAKE_FAILED_PROTOCOL | ZMQ_EVENT_HANDSHAKE_FAILED_AUTH;

// RFC 27: a peer with status 400 does not try again; one with status 300 does, after ZeroMQ has disconnected it.
constexpr const char* accepted = "200";
constexpr const char* retry_later = "300";

const char* offense_of(int error) noexcept {
  switch (error) {
    case EMSGSIZE:
      return "a message above the size limit";
    case EBADMSG:
      return "a message of several parts";
    case too_many_subscriptions:
      return "too many subscriptions";
    default:
      return "something that is not ZeroMQ's protocol";
  }
}

std::string decoded(const std::string& key) {
  std::string bytes(32, '\0');
  zmq_z85_decode(reinterpret_cast<std::uint8_t*>(bytes.data()), key.c_str());
  return bytes;
}
}  // namespace

PeerAdmission::PeerAdmission(const ServerAccess& access)
    : needs_keys_(access.keys.has_value()), max_peers_(access.max_peers) {
  for (const AllowedPeer& peer : access.allowed) names_.emplace(decoded(peer.public_key), peer.name);
}

PeerCounts PeerAdmission::counts() const noexcept {
  const auto of = [](const Count& count) { return count.load(std::memory_order_relaxed); };
  return {of(open_),   of(peers_),     of(admitted_), of(unknown_),
          of(excess_), of(malformed_), of(crowded_),  of(offending_)};
}

const char* PeerAdmission::admit(std::string_view mechanism, std::string_view key, std::string_view address) noexcept {
  using enum PeerVisit::Answer;
  const auto owner = needs_keys_ && mechanism == "CURVE" ? names_.find(key) : names_.end();
  if (needs_keys_ ? owner == names_.end() : mechanism != "NULL") {
    ++unknown_;
    add_visit(unknown, {}, address);
    return refused;
  }
  const std::string_view name = needs_keys_ ? std::string_view(owner->second) : std::string_view();
  if (peers_ >= max_peers_ || (needs_keys_ && holds_its_share(key))) {
    ++excess_;
    ++deferred_;
    add_visit(excess, name, address);
    return retry_later;
  }
  add_visit(admitted, name, address);
  if (needs_keys_) note_key(key, address);
  return accepted;
}

bool PeerAdmission::holds_its_share(std::string_view key) const {
  const auto held = static_cast<std::uint64_t>(
      std::ranges::count_if(keys_, [&](const auto& connection) { return connection.second == key; }));
  return names_.size() > 1 && held >= std::max<std::uint64_t>(1, max_peers_ / 2);
}

/// ZeroMQ's question does not name the connection: it is the oldest one from this address that has no key yet. Without
/// memory the connection is not counted.
void PeerAdmission::note_key(std::string_view key, std::string_view address) try {
  const std::pair<const std::int32_t, Clock::time_point>* oldest = nullptr;
  for (const auto& connection : connections_) {
    if (keys_.contains(connection.first) || !is_from(connection.first, address)) continue;
    if (oldest == nullptr || connection.second < oldest->second) oldest = &connection;
  }
  if (oldest != nullptr) keys_.emplace(oldest->first, key);
} catch (const std::bad_alloc&) {}

/// Without memory the visit is counted but not listed.
void PeerAdmission::add_visit(PeerVisit::Answer answer, std::string_view name, std::string_view address,
                              const char* offense) noexcept try {
  if (answer == PeerVisit::Answer::admitted && !name.empty()) {
    if (owners_.size() == max_owners) owners_.clear();
    owners_.insert_or_assign(std::string(address), std::string(name));
  }
  const std::lock_guard lock(visits_mutex_);
  if (visits_.size() < max_visits) visits_.push_back({answer, std::string(name), std::string(address), offense});
} catch (const std::bad_alloc&) {}

std::vector<PeerVisit> PeerAdmission::visits() {
  const std::lock_guard lock(visits_mutex_);
  return std::exchange(visits_, {});
}

void PeerAdmission::on_event(const SocketEvent& event) {
  if (event.kind == ZMQ_EVENT_ACCEPTED) {
    connections_[event.value] = Clock::now();
  } else if (event.kind == ZMQ_EVENT_HANDSHAKE_SUCCEEDED) {
    ++peers_;
    ++admitted_;
  } else if (event.kind == ZMQ_EVENT_DISCONNECTED) {
    on_disconnect(event.value);
  } else if (event.kind == peer_dropped) {
    on_offense(event.value, event.address.to_string_view());
  } else if (event.kind == ZMQ_EVENT_ACCEPT_FAILED && event.value == EMFILE) {
    ++crowded_;
  }
  if (event.kind == ZMQ_EVENT_HANDSHAKE_FAILED_NO_DETAIL && deferred_ > 0) {
    --deferred_;  // or an unknown peer disconnected meanwhile: it is counted once either way
  } else if (event.kind == ZMQ_EVENT_HANDSHAKE_FAILED_NO_DETAIL || event.kind == ZMQ_EVENT_HANDSHAKE_FAILED_PROTOCOL) {
    ++malformed_;
  }
  last_event_ = event.kind;
  open_ = connections_.size();
}

void PeerAdmission::on_offense(int error, std::string_view address) noexcept {
  ++offending_;
  const auto owner = owners_.find(address);
  add_visit(PeerVisit::Answer::offending, owner == owners_.end() ? std::string_view() : owner->second, address,
            offense_of(error));
}

// ZeroMQ does not report which connection succeeded. A connection with a failed handshake is disconnected right after
// that event. A connection that does not speak ZeroMQ is disconnected without another event, while the handshake may
// still run. All others were peers.
void PeerAdmission::on_disconnect(std::int32_t descriptor) {
  const auto found = connections_.find(descriptor);
  if (found == connections_.end()) return;
  const bool is_young = Clock::now() - found->second < max_handshake;
  const bool has_strangers = connections_.size() > peers_;
  connections_.erase(found);
  const bool has_failed = (last_event_ & all_failures) != 0;
  const bool was_peer = last_event_ == peer_dropped || (!has_failed && !(is_young && has_strangers));
  if (!has_failed && !was_peer) ++malformed_;
  keys_.erase(descriptor);
  if (was_peer && peers_ > 0) --peers_;
  if (peers_ > connections_.size()) peers_ = connections_.size();
}

ZapServer::ZapServer(zmq::context_t& context)
    : context_(context),
      requests_(context, zmq::socket_type::rep),
      wake_sender_(context, zmq::socket_type::pair),
      wake_receiver_(context, zmq::socket_type::pair) {
  requests_.set(zmq::sockopt::linger, 0);
  requests_.bind("inproc://zeromq.zap.01");
  wake_receiver_.bind("inproc://lbea.zap-wake");
  wake_sender_.connect("inproc://lbea.zap-wake");
  thread_ = std::thread(&ZapServer::run, this);
}

ZapServer::~ZapServer() {
  stopping_ = true;
  wake();
  thread_.join();
}

void ZapServer::wake() {
  const std::lock_guard lock(mutex_);
  zmq_send(wake_sender_.handle(), "", 0, ZMQ_DONTWAIT);
}

std::shared_ptr<PeerAdmission> ZapServer::attach(zmq::socket_t& socket, const ServerAccess& access) {
  auto admission = std::make_shared<PeerAdmission>(access);
  {
    const std::lock_guard lock(mutex_);
    const std::string domain = "lbea." + std::to_string(next_++);
    admissions_[domain] = admission;
    new_watches_.push_back({monitor(context_, socket, "inproc://" + domain, PeerAdmission::watched_events), admission});
    socket.set(zmq::sockopt::zap_domain, domain);
  }
  wake();
  return admission;
}

/// While memory is exhausted no peer is admitted; admitted peers stay connected.
void ZapServer::run() noexcept {
  while (!stopping_) {
    try {
      poll_once();
    } catch (const std::bad_alloc&) { std::this_thread::sleep_for(retry_delay); }
  }
}

void ZapServer::poll_once() {
  {
    const std::lock_guard lock(mutex_);
    watches_.reserve(watches_.size() + new_watches_.size());
    std::move(new_watches_.begin(), new_watches_.end(), std::back_inserter(watches_));
    new_watches_.clear();
  }
  std::vector<zmq_pollitem_t> items{{requests_.handle(), 0, ZMQ_POLLIN, 0},
                                    {wake_receiver_.handle(), 0, ZMQ_POLLIN, 0}};
  for (Watch& watch : watches_) items.push_back({watch.monitor.handle(), 0, ZMQ_POLLIN, 0});
  wait(items);
  std::erase_if(watches_, [](Watch& watch) { return !read_events(watch); });
  if (items[0].revents != 0) answer_request();
}

/// noexcept here and below: ZeroMQ without memory loses its own messages and can never be shut down, so the program
/// terminates.
void ZapServer::wait(std::span<zmq_pollitem_t> items) noexcept {
  if (zmq_poll(items.data(), static_cast<int>(items.size()), -1) < 0) return std::this_thread::sleep_for(retry_delay);
  char signal;
  if (items[1].revents != 0) zmq_recv(wake_receiver_.handle(), &signal, 1, ZMQ_DONTWAIT);
}

bool ZapServer::read_events(Watch& watch) {
  SocketEvent event;
  while (true) {
    const EventRead read = read_event(watch.monitor, event);
    if (read != EventRead::done) return read == EventRead::none;
    if (event.kind == ZMQ_EVENT_MONITOR_STOPPED) return false;
    watch.admission->on_event(event);
  }
}

// A request has the parts version, request id, domain, address, routing id, mechanism, credentials (RFC 27). Every
// request that was received must be answered, or the socket receives no other one: nothing here allocates.
void ZapServer::answer_request() noexcept {
  std::array<zmq::message_t, 7> request;
  zmq::message_t surplus;
  bool more = true;
  for (std::size_t i = 0; more; ++i) {
    zmq::message_t& part = i < request.size() ? request[i] : surplus;
    if (zmq_msg_recv(part.handle(), requests_.handle(), ZMQ_DONTWAIT) < 0) return;
    more = part.more();
  }
  std::shared_ptr<PeerAdmission> admission;
  {
    const std::lock_guard lock(mutex_);
    if (const auto found = admissions_.find(request[2].to_string_view()); found != admissions_.end())
      admission = found->second.lock();
  }
  const char* const status = admission ? admission->admit(request[5].to_string_view(), request[6].to_string_view(),
                                                          request[3].to_string_view())
                                       : PeerAdmission::refused;
  // The user id stays empty: ZeroMQ would queue it as a message for ever, which fills a queue of length 1.
  const std::array<std::string_view, 6> reply{"1.0", request[1].to_string_view(), status, "", "", ""};
  for (std::size_t i = 0; i < reply.size(); ++i)
    zmq_send(requests_.handle(), reply[i].data(), reply[i].size(), i + 1 < reply.size() ? ZMQ_SNDMORE : 0);
}
}  // namespace lbea::wire::detail
