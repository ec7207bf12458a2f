#include "adapters/wire/gate.hpp"

#include "adapters/wire/socket_event.hpp"

#include <algorithm>
#include <array>

namespace lbea::detail {

namespace {

using namespace std::chrono_literals;

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
  for (const AllowedPeer& peer : access.allowed) keys_.insert(decoded(peer.public_key));
}

PeerCounts Door::counts() const noexcept {
  const auto of = [](const Count& count) { return count.load(std::memory_order_relaxed); };
  return {of(open_), of(peers_), of(admitted_), of(unknown_), of(excess_), of(malformed_)};
}

const char* Door::answer(const std::string& mechanism, const std::string& key) {
  const bool is_known = wants_keys_ ? mechanism == "CURVE" && keys_.contains(key) : mechanism == "NULL";
  if (!is_known) {
    ++unknown_;
    return refused;
  }
  if (peers_ >= max_peers_) {
    ++excess_;
    ++put_off_;
    return come_back;
  }
  return welcome;
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

void Gate::run() {
  while (!stopping_) {
    {
      const std::lock_guard lock(mutex_);
      std::move(arrivals_.begin(), arrivals_.end(), std::back_inserter(watches_));
      arrivals_.clear();
    }
    std::vector<zmq_pollitem_t> items{{questions_.handle(), 0, ZMQ_POLLIN, 0}, {ear_.handle(), 0, ZMQ_POLLIN, 0}};
    for (Watch& watch : watches_) items.push_back({watch.monitor.handle(), 0, ZMQ_POLLIN, 0});
    if (zmq_poll(items.data(), static_cast<int>(items.size()), -1) < 0 && zmq_errno() != EINTR) return;
    char ring;
    if (items[1].revents != 0) zmq_recv(ear_.handle(), &ring, 1, ZMQ_DONTWAIT);
    std::erase_if(watches_, [](Watch& watch) { return !hear(watch); });
    if (items[0].revents != 0) answer();
  }
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

// A question: version, request id, domain, address, routing id, mechanism, credentials (RFC 27).
void Gate::answer() {
  std::vector<std::string> question;
  bool more = true;
  while (more) {
    zmq::message_t part;
    if (zmq_msg_recv(part.handle(), questions_.handle(), ZMQ_DONTWAIT) < 0) return;
    question.push_back(part.to_string());
    more = part.more();
  }
  question.resize(7);
  std::shared_ptr<Door> door;
  {
    const std::lock_guard lock(mutex_);
    if (const auto found = doors_.find(question[2]); found != doors_.end()) door = found->second.lock();
  }
  // No name for the peer: ZeroMQ would let it take up a place of the socket's queue for ever, the only one of a queue of 1.
  const std::array<std::string, 6> answer{
      "1.0", question[1], door ? door->answer(question[5], question[6]) : refused, "", "", ""};
  for (std::size_t i = 0; i < answer.size(); ++i)
    zmq_send(questions_.handle(), answer[i].data(), answer[i].size(), i + 1 < answer.size() ? ZMQ_SNDMORE : 0);
}

}  // namespace lbea::detail
