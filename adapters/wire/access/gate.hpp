// Who comes in: answers ZeroMQ's question for every new connection to a bound socket (ZAP), in a thread of its own,
// and watches what becomes of the connections. Only the .cpp files of this folder include it.
#pragma once

#include "adapters/wire/access/door.hpp"

#include <atomic>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <span>
#include <thread>

#include <zmq.hpp>

namespace lbea::wire::detail {

class Gate {
 public:
  explicit Gate(zmq::context_t& context);
  ~Gate();
  Gate(const Gate&) = delete;
  Gate& operator=(const Gate&) = delete;
  /// Puts a door before a socket, which is to be bound afterwards.
  [[nodiscard]] std::shared_ptr<Door> guard(zmq::socket_t& socket, const ServerAccess& access);

 private:
  struct Watch {
    zmq::socket_t monitor;
    std::shared_ptr<Door> door;
  };
  void wake();
  void run() noexcept;
  void turn();
  void wait(std::span<zmq_pollitem_t> items) noexcept;
  void answer() noexcept;
  /// False once the socket is gone.
  static bool hear(Watch& watch);

  zmq::context_t& context_;
  zmq::socket_t questions_, bell_, ear_;
  std::mutex mutex_;  // guards what follows, and bell_
  std::vector<Watch> arrivals_;
  std::map<std::string, std::weak_ptr<Door>, std::less<>> doors_;
  std::uint64_t next_ = 0;
  std::atomic<bool> stopping_{false};
  std::vector<Watch> watches_;  // the thread's
  std::thread thread_;
};

}  // namespace lbea::wire::detail
