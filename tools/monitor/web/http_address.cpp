#include "tools/monitor/web/http_address.hpp"

#include <lbea/lbea.hpp>

#include <charconv>

#include <arpa/inet.h>

namespace lbea::tool {
namespace {

bool is_ipv4(const std::string& host) {
  in_addr address{};
  return inet_pton(AF_INET, host.c_str(), &address) == 1;
}

bool is_ipv6(const std::string& host) {
  in6_addr address{};
  return inet_pton(AF_INET6, host.c_str(), &address) == 1;
}

[[noreturn]] void refuse(const std::string& text, const std::string& why) {
  throw Error(Status::bad_config,
              "--http \"" + text + "\": " + why + "; give an address in numbers and a port, e.g. 127.0.0.1:8080");
}

}  // namespace

bool is_numeric_address(const std::string& host) { return is_ipv4(host) || is_ipv6(host); }

HttpAddress parse_http_address(const std::string& text) {
  const std::size_t colon = text.rfind(':');
  if (colon == std::string::npos) refuse(text, "has no port");
  HttpAddress address;
  address.host = text.substr(0, colon);
  const bool bracketed = address.host.size() > 2 && address.host.front() == '[' && address.host.back() == ']';
  if (bracketed) address.host = address.host.substr(1, address.host.size() - 2);
  if (address.host == "localhost") address.host = "127.0.0.1";
  if (bracketed ? !is_ipv6(address.host) : !is_ipv4(address.host)) refuse(text, "is not an address in numbers");
  const char* end = text.data() + text.size();
  const auto [stop, error] = std::from_chars(text.data() + colon + 1, end, address.port);
  if (error != std::errc{} || stop != end) refuse(text, "its port is not a number from 0 to 65535");
  address.is_loopback = address.host == "::1" || (!bracketed && address.host.starts_with("127."));
  return address;
}

}  // namespace lbea::tool
