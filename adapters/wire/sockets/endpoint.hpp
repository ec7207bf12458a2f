// Endpoint addresses. Set-up only: the functions throw Error with the endpoint in the sentence.
#pragma once

#include <filesystem>
#include <string>
#include <utility>

namespace lbea::wire {
enum class Transport { ipc, tcp, inproc };

struct Endpoint {
  Transport transport = Transport::ipc;
  std::string address;         // as given, for example "tcp://127.0.0.1:5555"
  std::filesystem::path path;  // ipc only
};

/// Throws Error{bad_config} for anything that is not ipc://PATH, tcp://HOST:PORT or inproc://NAME.
[[nodiscard]] Endpoint parse_endpoint(const std::string& address);
/// HOST and PORT of tcp://HOST:PORT. Throws Error{bad_config} without a port.
[[nodiscard]] std::pair<std::string, std::string> host_and_port(const std::string& address);
/// For --help: an ipc endpoint where there are such, else one of tcp.
[[nodiscard]] std::string example_endpoint(const std::string& name, int port);
/// Throws Error{bad_config} 'endpoint "ADDRESS": WHY'.
[[noreturn]] void refuse_endpoint(const std::string& address, const std::string& why);
/// Throws Error{endpoint_unavailable} 'endpoint "ADDRESS"WHAT'.
[[noreturn]] void fail_unavailable(const std::string& address, const std::string& what);
}  // namespace lbea::wire
