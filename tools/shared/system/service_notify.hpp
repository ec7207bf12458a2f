// Notifies systemd (Type=notify): ready, alive, stopping. Does nothing without systemd, which names its socket in
// NOTIFY_SOCKET.
#pragma once

#include <string>

namespace lbea::tool {

class ServiceNotify {
 public:
  /// Reads NOTIFY_SOCKET, WATCHDOG_USEC and WATCHDOG_PID and removes them, so that child processes do not use them.
  ServiceNotify();
  ~ServiceNotify();
  ServiceNotify(const ServiceNotify&) = delete;
  ServiceNotify& operator=(const ServiceNotify&) = delete;

  void ready(const std::string& status) const noexcept;
  void status(const std::string& status) const noexcept;
  void alive() const noexcept;
  void stopping() const noexcept;

 private:
  void tell(const std::string& text) const noexcept;
  int socket_ = -1;
};

}  // namespace lbea::tool
