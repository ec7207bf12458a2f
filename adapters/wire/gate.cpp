#include "adapters/wire/gate.hpp"

#include "adapters/wire/socket_event.hpp"

#include <algorithm>
#include <array>
#include <iterator>
#include <new>
#include <string_view>
#include <utility>

namespace lbea::detail {

namespace {

using namespace std::chrono_literals;

constexpr std::size_t most_visits = 64;
constexpr auto breather = 10ms;          // until the next try when something is in short supply
constexpr auto longest_handshake = 3s;  // ZeroMQ ends a connection that takes longer (see socket.cpp)
constexpr int all_endings = ZMQ_EVENT_DISCONNECTED | ZMQ_EVENT_MONITOR_STOPPED;
constexpr int all_failures = ZMQ_EVENT_HANDSHAKE_FAILED_NO_DETAIL | ZMQ_EVENT_HANDSHAKE_FAILED_PROTOCOL |
                             ZMQ_EVENT_HANDSHAKE_FAILED_AUTH;
constexpr int watched = ZMQ_EVENT_ACCEPTED | ZMQ_EVENT_HANDSHAKE_SUCCEEDED | all_failures | all_endings;

// A peer that is refused does not try again; one that is to come back does, once ZeroMQ has let go of it.
constexpr const char* welcome = "200";
constexpr const char* come_back = "300";
constexpr const char* refused = "400";

std::string decoded(const std::string& key) {
  std::string bytes(32, '\0');
  zmq_z85_decode(reinterpret_cast<std::uint8_t*>(bytes.data()), key.c_str());
  return bytes;
}

}  // namespace

Door::Door(std::string domain, const ServerAccess& access)
    : domain_(std::move(domain)),
      wants_keys_(access.keys.has_value()),
      max_peers_(access.max_peers) {
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
  } catch (const std::bad_alloc&) {
  }
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

Gate::Gate(zmq::context_t& context)
    : context_(context),
      questions_(context, zmq::socket_type::rep),
      bell_(context, zmq::socket_type::pair),
      ear_(context, zmq::socket_type::pair) {
  questions_.set(zmq::sockopt::linger, 0);
  questions_.bind("inproc://zeromq.zap.01");
  ear_.bind("inproc://lbea.gate");
  bell_.connect("inproc://lbea.gate");
  thread_ = std::thread(&Gate::run, this);
}

Gate::~Gate() {
  stopping_ = true;
  wake();
  thread_.join();
}

void Gate::wake() {
  const std::lock_guard lock(mutex_);
  zmq_send(bell_.handle(), "", 0, ZMQ_DONTWAIT);
}

std::shared_ptr<Door> Gate::guard(zmq::socket_t& socket, const ServerAccess& access) {
  std::shared_ptr<Door> door;
  {
    const std::lock_guard lock(mutex_);
    const std::string name = "lbea." + std::to_string(next_++);
    door = std::make_shared<Door>(name, access);
    doors_[name] = door;
    const std::string address = "inproc://" + name;
    zmq_socket_monitor(socket.handle(), address.c_str(), watched);
    zmq::socket_t monitor(context_, zmq::socket_type::pair);
    monitor.set(zmq::sockopt::linger, 0);
    monitor.set(zmq::sockopt::rcvhwm, 0);  // bounded by the connections; a full one would stop ZeroMQ's I/O thread
    monitor.connect(address);
    arrivals_.push_back({std::move(monitor), door});
    socket.set(zmq::sockopt::zap_domain, name);
  }
  wake();
  return door;
}

/// Without memory for a moment nobody comes in, and who is in stays.
void Gate::run() noexcept {
  while (!stopping_) {
    try {
      turn();
    } catch (const std::bad_alloc&) {
      std::this_thread::sleep_for(breather);
    }
  }
}

void Gate::turn() {
  {
    const std::lock_guard lock(mutex_);
    watches_.reserve(watches_.size() + arrivals_.size());
    std::move(arrivals_.begin(), arrivals_.end(), std::back_inserter(watches_));
    arrivals_.clear();
  }
  std::vector<zmq_pollitem_t> items{{questions_.handle(), 0, ZMQ_POLLIN, 0}, {ear_.handle(), 0, ZMQ_POLLIN, 0}};
  for (Watch& watch : watches_) items.push_back({watch.monitor.handle(), 0, ZMQ_POLLIN, 0});
  wait(items);
  std::erase_if(watches_, [](Watch& watch) { return !hear(watch); });
  if (items[0].revents != 0) answer();
}

/// ZeroMQ without memory loses its own words and can never be ended: then the program ends, here and in what else is noexcept.
void Gate::wait(std::span<zmq_pollitem_t> items) noexcept {
  if (zmq_poll(items.data(), static_cast<int>(items.size()), -1) < 0) return std::this_thread::sleep_for(breather);
  char ring;
  if (items[1].revents != 0) zmq_recv(ear_.handle(), &ring, 1, ZMQ_DONTWAIT);
}

bool Gate::hear(Watch& watch) {
  SocketEvent event;
  while (true) {
    const EventRead read = read_event(watch.monitor, event);
    if (read != EventRead::done) return read == EventRead::none;
    if (event.kind == ZMQ_EVENT_MONITOR_STOPPED) return false;
    watch.door->note(event.kind, event.value);
  }
}

// A question: version, request id, domain, address, routing id, mechanism, credentials (RFC 27). A question that was taken must be
// answered, or the socket takes no other one: nothing here allocates.
void Gate::answer() noexcept {
  std::array<zmq::message_t, 7> question;
  zmq::message_t surplus;
  bool more = true;
  for (std::size_t i = 0; more; ++i) {
    zmq::message_t& part = i < question.size() ? question[i] : surplus;
    if (zmq_msg_recv(part.handle(), questions_.handle(), ZMQ_DONTWAIT) < 0) return;
    more = part.more();
  }
  std::shared_ptr<Door> door;
  {
    const std::lock_guard lock(mutex_);
    if (const auto found = doors_.find(question[2].to_string_view()); found != doors_.end()) door = found->second.lock();
  }
  const char* const verdict = door ? door->answer(question[5].to_string_view(), question[6].to_string_view(), question[3].to_string_view()) : refused;
  // No name for the peer: ZeroMQ would let it take up a place of the socket's queue for ever, the only one of a queue of 1.
  const std::array<std::string_view, 6> answer{"1.0", question[1].to_string_view(), verdict, "", "", ""};
  for (std::size_t i = 0; i < answer.size(); ++i)
    zmq_send(questions_.handle(), answer[i].data(), answer[i].size(), i + 1 < answer.size() ? ZMQ_SNDMORE : 0);
}

}  // namespace lbea::detail
