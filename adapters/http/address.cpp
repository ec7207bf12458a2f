#include "adapters/http/server.hpp"

#include <lbea/lbea.hpp>

#include <algorithm>
#include <charconv>

#ifdef _WIN32
#include <ws2tcpip.h>
#else
#include <arpa/inet.h>
#endif

namespace lbea::http {
namespace {

bool is_address(const std::string& host, int family) {
  in6_addr address{};  // also large enough for an IPv4 address
  return inet_pton(family, host.c_str(), &address) == 1;
}

}  // namespace

bool is_numeric_address(const std::string& host) { return is_address(host, AF_INET) || is_address(host, AF_INET6); }

bool is_loopback_address(const std::string& host) {
  return host == "::1" || (host.starts_with("127.") && is_address(host, AF_INET));
}

std::string_view host_name(std::string_view host) noexcept {
  if (!host.starts_with('[')) return host.substr(0, host.find(':'));
  const std::size_t end = host.find(']');
  const bool is_address = end != std::string_view::npos && (end + 1 == host.size() || host[end + 1] == ':');
  return is_address ? host.substr(1, end - 1) : host;
}

Address parse_address(const std::string& text, const std::string& option) {
  const auto refuse = [&](const std::string& why) {
    return Error(Status::bad_config,
                 option + " \"" + text + "\": " + why + "; give a numeric address and a port, e.g. 127.0.0.1:8080");
  };
  const std::size_t colon = text.rfind(':');
  if (colon == std::string::npos) throw refuse("the port is missing");
  Address address;
  address.host = text.substr(0, colon);
  const bool bracketed = address.host.size() > 2 && address.host.front() == '[' && address.host.back() == ']';
  if (bracketed) address.host = address.host.substr(1, address.host.size() - 2);
  if (address.host == "localhost") address.host = "127.0.0.1";
  if (!is_address(address.host, bracketed ? AF_INET6 : AF_INET)) throw refuse("the address is not numeric");
  const char* end = text.data() + text.size();
  const auto [stop, error] = std::from_chars(text.data() + colon + 1, end, address.port);
  if (error != std::errc{} || stop != end) throw refuse("the port is not a number from 0 to 65535");
  address.is_loopback = is_loopback_address(address.host);
  return address;
}

std::string to_string(const Address& address) {
  const bool is_v6 = address.host.find(':') != std::string::npos;
  return (is_v6 ? "[" + address.host + "]" : address.host) + ":" + std::to_string(address.port);
}

std::string_view pair_value(std::string_view pairs, std::string_view separator, std::string_view key) noexcept {
  while (!pairs.empty()) {
    const std::size_t end = std::min(pairs.find(separator.front()), pairs.size());
    const std::string_view pair = pairs.substr(0, end);
    pairs.remove_prefix(std::min(end + separator.size(), pairs.size()));
    if (pair.size() > key.size() && pair.starts_with(key) && pair[key.size()] == '=')
      return pair.substr(key.size() + 1);
  }
  return {};
}

std::string_view query_value(std::string_view target, std::string_view key) noexcept {
  const std::size_t question = target.find('?');
  return question == std::string_view::npos ? std::string_view{} : pair_value(target.substr(question + 1), "&", key);
}

}  // namespace lbea::http
