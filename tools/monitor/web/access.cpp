#include "tools/monitor/web/access.hpp"

#include "adapters/files/text_line.hpp"

#include <lbea/lbea.hpp>

#include <algorithm>

#include <sys/random.h>

namespace lbea::tool {
namespace {

/// In constant time for texts of equal length.
bool same_secret(std::string_view a, std::string_view b) noexcept {
  if (a.size() != b.size()) return false;
  unsigned difference = 0;
  for (std::size_t i = 0; i < a.size(); ++i)
    difference |= static_cast<unsigned char>(a[i]) ^ static_cast<unsigned>(static_cast<unsigned char>(b[i]));
  return difference == 0;
}

using io::text::lower;

/// "rig.example:8443" of "https://rig.example:8443"; empty for another form.
std::string_view host_of(std::string_view origin) {
  for (const std::string_view scheme : {"https://", "http://"})
    if (origin.starts_with(scheme) && origin.find_first_of("/?#@ ", scheme.size()) == std::string_view::npos)
      return origin.substr(scheme.size());
  return {};
}

}  // namespace

std::string_view explain(Access access) noexcept {
  if (access == Access::wrong_method) return "This page is read-only: use GET or HEAD.";
  if (access == Access::wrong_host)
    return "This page is not served under that host name. Use the address that lbea-monitor printed, or start it "
           "with --allow-host, or behind a proxy with --public-origin.";
  if (access == Access::wrong_origin) return "Pages of other sites may not read this page.";
  return access == Access::wrong_token ? "Open the address that lbea-monitor printed; it ends with a token." : "";
}

AccessRules::AccessRules(http::Address address, std::vector<std::string> names, std::string token,
                         std::vector<std::string> viewer_origins, std::string public_origin)
    : address_(std::move(address)),
      names_(std::move(names)),
      viewer_origins_(std::move(viewer_origins)),
      token_(std::move(token)),
      public_origin_(lower(public_origin)) {
  for (std::string& name : names_) name = lower(name);
  for (std::string& origin : viewer_origins_) origin = lower(origin);
  if (!public_origin_.empty() && host_of(public_origin_).empty())
    throw Error(Status::bad_config,
                "--public-origin \"" + public_origin_ + "\": give scheme and host only, such as https://rig.example");
  if (token_.empty() && (!address_.is_loopback || !public_origin_.empty()))
    throw Error(Status::bad_config, "other machines can reach " + address_.host + "; serving there needs a token");
}

std::string AccessRules::cookie_name() const { return "lbea_monitor_" + std::to_string(address_.port); }

bool AccessRules::knows_host(std::string_view asked) const {
  std::string host = lower(asked);
  if (!public_origin_.empty() && host == host_of(public_origin_)) return true;
  const std::string port = ":" + std::to_string(address_.port);
  if (host.ends_with(port))
    host.resize(host.size() - port.size());
  else if (address_.port != 80)
    return false;
  if (std::ranges::find(names_, host) != names_.end()) return true;
  if (host == "localhost" || host == "127.0.0.1" || host == "[::1]") return true;
  if (host.size() > 2 && host.front() == '[' && host.back() == ']') host = host.substr(1, host.size() - 2);
  // Anybody can point a name at this machine; a numeric address cannot be rebound.
  return address_.is_loopback ? host == address_.host : http::is_numeric_address(host);
}

Access AccessRules::check(const http::Request& request) const {
  if (request.method != "GET" && request.method != "HEAD") return Access::wrong_method;
  if (!knows_host(request.host)) return Access::wrong_host;
  if (!is_own_origin(request)) return Access::wrong_origin;
  return check_token(request);
}

Access AccessRules::check_viewer(const http::Request& request) const {
  if (request.method != "GET") return Access::wrong_method;
  if (!knows_host(request.host)) return Access::wrong_host;
  if (!is_own_origin(request) && std::ranges::find(viewer_origins_, lower(request.origin)) == viewer_origins_.end())
    return Access::wrong_origin;
  const Access access = check_token(request);
  return access == Access::token_in_address ? Access::granted : access;
}

bool AccessRules::is_own_origin(const http::Request& request) const {
  if (request.origin.empty()) return true;
  const std::string origin = lower(request.origin);
  return origin == "http://" + lower(request.host) || (!public_origin_.empty() && origin == public_origin_);
}

Access AccessRules::check_token(const http::Request& request) const {
  if (token_.empty()) return Access::granted;
  constexpr std::string_view bearer = "Bearer ";
  if (request.authorization.starts_with(bearer) && same_secret(request.authorization.substr(bearer.size()), token_))
    return Access::granted;
  if (same_secret(http::pair_value(request.cookie, "; ", cookie_name()), token_)) return Access::granted;
  return same_secret(http::query_value(request.target, "token"), token_) ? Access::token_in_address
                                                                         : Access::wrong_token;
}

std::string random_token() {
  std::array<unsigned char, 16> bytes{};
  if (::getrandom(bytes.data(), bytes.size(), 0) != static_cast<ssize_t>(bytes.size()))
    throw Error(Status::bad_config, "the system has no random numbers for a token");
  std::string token;
  for (const unsigned char byte : bytes)
    for (const int digit : {byte >> 4, byte & 15}) token += "0123456789abcdef"[digit];
  return token;
}

}  // namespace lbea::tool
