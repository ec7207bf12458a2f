// Who may ask: checked for every request, before anything else of it is looked at.
#pragma once

#include "tools/monitor/web/http_address.hpp"

#include <string>
#include <string_view>
#include <vector>

namespace lbea::tool {

/// What of a request decides; empty when absent.
struct RequestHead {
  std::string_view method, target, host, origin, cookie, authorization;
};

enum class Access : std::uint8_t {
  granted,
  token_in_address,  // right, but to be moved from the address to a cookie
  wrong_method,      // neither GET nor HEAD
  wrong_host,        // a name that is not ours: another site's page that rebound its name to our address
  wrong_origin,      // another site's page
  wrong_token,
};
/// In words, for the browser.
[[nodiscard]] std::string_view explain(Access access) noexcept;

class AccessRules {
 public:
  /// `names`: under which hosts the page is asked for, beside the address. `token`: empty when none is needed, which
  /// only a loopback address allows: throws Error{bad_config} otherwise. `viewer_origins`: pages of other sites whose
  /// viewers may connect, such as "https://viewer.example".
  AccessRules(HttpAddress address, std::vector<std::string> names, std::string token,
              std::vector<std::string> viewer_origins = {});

  [[nodiscard]] Access check(const RequestHead& head) const;
  /// For a viewer, which has no cookies: the token may stay in the address.
  [[nodiscard]] Access check_viewer(const RequestHead& head) const;
  [[nodiscard]] const std::string& token() const noexcept { return token_; }
  /// Cookies know no ports: the name tells several monitors on one machine apart.
  [[nodiscard]] std::string cookie_name() const;

 private:
  [[nodiscard]] bool knows_host(std::string_view host) const;
  [[nodiscard]] bool is_own_origin(const RequestHead& head) const;
  [[nodiscard]] Access check_token(const RequestHead& head) const;
  HttpAddress address_;
  std::vector<std::string> names_, viewer_origins_;
  std::string token_;
};

/// 128 bits in hexadecimal, from the system. Throws Error{bad_config} when it has none.
[[nodiscard]] std::string random_token();

/// The value of `key` in a query or target such as "/?a=1&b=2"; empty when absent. Nothing is unescaped.
[[nodiscard]] std::string_view query_value(std::string_view target, std::string_view key) noexcept;

}  // namespace lbea::tool
