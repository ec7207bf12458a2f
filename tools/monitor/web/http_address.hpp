// Where the page is served.
#pragma once

#include <cstdint>
#include <string>

namespace lbea::tool {

struct HttpAddress {
  std::string host;        // a numeric address, without brackets
  std::uint16_t port = 0;  // 0: any free one
  bool is_loopback = false;
};

/// "127.0.0.1:8080", "[::1]:8080", "localhost:8080". Throws Error{bad_config}: also for names other than localhost.
[[nodiscard]] HttpAddress parse_http_address(const std::string& text);

/// Whether `host` is an address in numbers, IPv4 or (without brackets) IPv6.
[[nodiscard]] bool is_numeric_address(const std::string& host);

}  // namespace lbea::tool
