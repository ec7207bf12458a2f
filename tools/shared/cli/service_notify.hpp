// Words to systemd (Type=notify): ready, alive, stopping. Without systemd, which names its socket in NOTIFY_SOCKET,
// all of it does nothing.
#pragma once

#include <chrono>
#include <optional>
#include <string>

namespace lbea::tool {

class ServiceNotify {
 public:
  /// Reads NOTIFY_SOCKET, WATCHDOG_USEC and WATCHDOG_PID, which concern this process alone, and removes them.
  ServiceNotify();
  ~ServiceNotify();
  ServiceNotify(const ServiceNotify&) = delete;
  ServiceNotify& operator=(const ServiceNotify&) = delete;

  /// How often alive() is expected, at least; nothing when nobody watches.
  [[nodiscard]] std::optional<std::chrono::microseconds> watchdog() const noexcept { return watchdog_; }
  void ready(const std::string& status) const noexcept;
  void status(const std::string& status) const noexcept;
  void alive() const noexcept;
  void stopping() const noexcept;

 private:
  void tell(const std::string& text) const noexcept;
  int socket_ = -1;
  std::optional<std::chrono::microseconds> watchdog_;
};

}  // namespace lbea::tool
