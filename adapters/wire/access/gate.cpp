#include "adapters/wire/access/gate.hpp"

#include "adapters/wire/sockets/socket_event.hpp"

#include <algorithm>
#include <array>
#include <iterator>
#include <new>
#include <string_view>

namespace lbea::wire::detail {
namespace {

constexpr std::chrono::milliseconds breather{10};  // until the next try when something is in short supply

}  // namespace

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
    zmq_socket_monitor(socket.handle(), address.c_str(), Door::watched);
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
    } catch (const std::bad_alloc&) { std::this_thread::sleep_for(breather); }
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

/// ZeroMQ without memory loses its own words and can never be ended: then the program ends, here and in what else is
/// noexcept.
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

// A question: version, request id, domain, address, routing id, mechanism, credentials (RFC 27). A question that was
// taken must be answered, or the socket takes no other one: nothing here allocates.
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
    if (const auto found = doors_.find(question[2].to_string_view()); found != doors_.end())
      door = found->second.lock();
  }
  const char* const verdict =
      door ? door->answer(question[5].to_string_view(), question[6].to_string_view(), question[3].to_string_view())
           : Door::refused;
  // No name for the peer: ZeroMQ would let it take up a place of the socket's queue for ever, the only one of a queue
  // of 1.
  const std::array<std::string_view, 6> answer{"1.0", question[1].to_string_view(), verdict, "", "", ""};
  for (std::size_t i = 0; i < answer.size(); ++i)
    zmq_send(questions_.handle(), answer[i].data(), answer[i].size(), i + 1 < answer.size() ? ZMQ_SNDMORE : 0);
}

}  // namespace lbea::wire::detail
