// Access rules of the page. They are checked for every request before anything else.
#pragma once

#include "adapters/http/server.hpp"

namespace lbea::tool {

enum class Access : std::uint8_t {
  granted,
  token_in_address,  // correct, but to be moved from the address to a cookie
  wrong_method,      // neither GET nor HEAD
  wrong_host,        // an unknown host name: a page of another site may have rebound its name to our address
  wrong_origin,      // a page of another site
  wrong_token,
};
/// A sentence for the browser; empty where the request is not refused.
[[nodiscard]] std::string_view explain(Access access) noexcept;

class AccessRules {
 public:
  /// `names`: further host names under which browsers may request the page. `token`: may be empty only for a loopback
  /// address without `public_origin`. `viewer_origins`: sites whose viewers may connect, such as
  /// "https://viewer.example". `public_origin`: of a proxy in front of the page, such as "https://rig.example"; may be
  /// empty. Throws Error{bad_config} for a missing token and for an origin of another form.
  AccessRules(http::Address address, std::vector<std::string> names, std::string token,
              std::vector<std::string> viewer_origins = {}, std::string public_origin = {});

  void set_port(std::uint16_t port) noexcept { address_.port = port; }
  [[nodiscard]] Access check(const http::Request& request) const;
  /// For a viewer, which has no cookies: the token may stay in the address.
  [[nodiscard]] Access check_viewer(const http::Request& request) const;
  [[nodiscard]] const std::string& token() const noexcept { return token_; }
  [[nodiscard]] const std::string& public_origin() const noexcept { return public_origin_; }
  /// Includes the port: cookies are shared between ports, and several monitors may run on one machine.
  [[nodiscard]] std::string cookie_name() const;

 private:
  [[nodiscard]] bool knows_host(std::string_view host) const;
  [[nodiscard]] bool is_own_origin(const http::Request& request) const;
  [[nodiscard]] Access check_token(const http::Request& request) const;
  http::Address address_;
  std::vector<std::string> names_, viewer_origins_;
  std::string token_, public_origin_;
};

/// 128 random bits in hexadecimal. Throws Error{bad_config} when the system has no random numbers.
[[nodiscard]] std::string random_token();

}  // namespace lbea::tool
