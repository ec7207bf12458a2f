#include "adapters/wire/sockets/endpoint.hpp"

#include <lbea/lbea.hpp>

#include <charconv>
#include <cstring>

namespace lbea::wire {
namespace {
#ifdef _WIN32
constexpr bool has_ipc = false;
constexpr std::string_view known_forms = "write tcp://127.0.0.1:5555";
#else
constexpr bool has_ipc = true;
constexpr std::string_view known_forms = "write ipc:///tmp/frames.ipc or tcp://127.0.0.1:5555";
#endif
constexpr std::size_t max_ipc_path = 107;  // unix(7)

void check_port(const std::string& address, const std::string& port) {
  if (port == "*") return;
  unsigned value = 0;
  const auto [end, error] = std::from_chars(port.data(), port.data() + port.size(), value);
  if (error != std::errc{} || end != port.data() + port.size() || value == 0 || value > 65'535)
    refuse_endpoint(address, "\"" + port + "\" is not a port from 1 to 65535");
}

std::filesystem::path ipc_path(const std::string& address) {
  if (!has_ipc) refuse_endpoint(address, "not available on Windows; " + std::string(known_forms));
  const std::string path = address.substr(std::strlen("ipc://"));
  if (path.empty() || path[0] == '@' || path[0] == '*')
    refuse_endpoint(address, "needs the path of a file; " + std::string(known_forms));
  if (path.size() > max_ipc_path)
    refuse_endpoint(address, "the path is longer than the " + std::to_string(max_ipc_path) +
                                 " bytes a socket may have; choose a shorter one");
  return path;
}

}  // namespace

std::string example_endpoint(const std::string& name, int port) {
  return has_ipc ? "ipc:///tmp/" + name + ".ipc" : "tcp://127.0.0.1:" + std::to_string(port);
}

void refuse_endpoint(const std::string& address, const std::string& why) {
  throw Error{Status::bad_config, "endpoint \"" + address + "\": " + why};
}

std::pair<std::string, std::string> host_and_port(const std::string& address) {
  const std::string rest = address.substr(std::strlen("tcp://"));
  const auto colon = rest.rfind(':');
  if (colon == std::string::npos) refuse_endpoint(address, "no port; " + std::string(known_forms));
  return {rest.substr(0, colon), rest.substr(colon + 1)};
}

Endpoint parse_endpoint(const std::string& address) {
  if (address.starts_with("ipc://")) return {Transport::ipc, address, ipc_path(address)};
  if (address.starts_with("inproc://") && address.size() > std::strlen("inproc://"))
    return {Transport::inproc, address, {}};
  if (!address.starts_with("tcp://")) refuse_endpoint(address, "not an endpoint; " + std::string(known_forms));
  const auto [host, port] = host_and_port(address);
  if (host.empty()) refuse_endpoint(address, "no host; " + std::string(known_forms));
  check_port(address, port);
  return {Transport::tcp, address, {}};
}

void fail_unavailable(const std::string& address, const std::string& what) {
  throw Error{Status::endpoint_unavailable, "endpoint \"" + address + "\"" + what};
}

}  // namespace lbea::wire
