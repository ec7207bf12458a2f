// Answers HTTP on a port of this machine with one page of text, for a Prometheus agent or a curl. One thread; a few
// connections at a time, each with a deadline, so that nobody can make it grow or hang.
#pragma once

#include <cstddef>
#include <functional>
#include <memory>
#include <string>

namespace lbea::http {

class MetricsServer {
 public:
  struct Limits {
    std::size_t connections = 16;      // at a time; more are closed at once
    std::size_t request_bytes = 8192;  // of a request's header
    int deadline_ms = 5000;            // for a request and its answer
  };

  /// Serves /metrics at `address`, e.g. "127.0.0.1:9464" (port 0: any free one). `page` is called in the server's
  /// thread for every request and must not throw.
  /// Throws Error{bad_config} for an address that is not of this machine, Error{endpoint_unavailable} for one in use.
  MetricsServer(const std::string& address, std::function<std::string()> page, Limits limits);
  MetricsServer(const std::string& address, std::function<std::string()> page)
      : MetricsServer(address, std::move(page), Limits{}) {}
  ~MetricsServer();
  MetricsServer(const MetricsServer&) = delete;
  MetricsServer& operator=(const MetricsServer&) = delete;
  /// As bound: with the port's number.
  [[nodiscard]] std::string address() const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace lbea::http
