#include "tools/monitor/web/access.hpp"

#include <lbea/lbea.hpp>

#include <algorithm>
#include <array>

#include <sys/random.h>

namespace lbea::tool {
namespace {

/// Takes as long for any wrong text of the right length.
bool same_secret(std::string_view a, std::string_view b) noexcept {
  if (a.size() != b.size()) return false;
  unsigned difference = 0;
  for (std::size_t i = 0; i < a.size(); ++i)
    difference |= static_cast<unsigned char>(a[i]) ^ static_cast<unsigned>(static_cast<unsigned char>(b[i]));
  return difference == 0;
}

std::string_view cookie_value(std::string_view cookies, std::string_view name) noexcept {
  while (!cookies.empty()) {
    const std::size_t end = std::min(cookies.find(';'), cookies.size());
    const std::string_view pair = cookies.substr(0, end);
    cookies.remove_prefix(std::min(end + 2, cookies.size()));
    if (pair.size() > name.size() && pair.starts_with(name) && pair[name.size()] == '=')
      return pair.substr(name.size() + 1);
  }
  return {};
}

std::string lower(std::string_view text) {
  std::string result(text);
  std::ranges::transform(result, result.begin(),
                         [](char c) { return c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c; });
  return result;
}

}  // namespace

std::string_view explain(Access access) noexcept {
  switch (access) {
    case Access::wrong_method:
      return "This page can only be looked at: GET and HEAD.";
    case Access::wrong_host:
      return "This page is not served under that name. Use the address that lbea-monitor printed, or start it with "
             "--allow-host.";
    case Access::wrong_origin:
      return "Pages of other sites may not read this one.";
    case Access::wrong_token:
      return "Open the address that lbea-monitor printed: it ends with a token.";
    default:
      return "";
  }
}

AccessRules::AccessRules(HttpAddress address, std::vector<std::string> names, std::string token,
                         std::vector<std::string> viewer_origins)
    : address_(std::move(address)),
      names_(std::move(names)),
      viewer_origins_(std::move(viewer_origins)),
      token_(std::move(token)) {
  for (std::string& name : names_) name = lower(name);
  for (std::string& origin : viewer_origins_) origin = lower(origin);
  if (token_.empty() && !address_.is_loopback)
    throw Error(Status::bad_config, "serving on " + address_.host + ", which other machines reach, needs a token");
}

std::string AccessRules::cookie_name() const { return "lbea_monitor_" + std::to_string(address_.port); }

bool AccessRules::knows_host(std::string_view asked) const {
  std::string host = lower(asked);
  const std::string port = ":" + std::to_string(address_.port);
  if (host.ends_with(port))
    host.resize(host.size() - port.size());
  else if (address_.port != 80)
    return false;
  if (std::ranges::find(names_, host) != names_.end()) return true;
  if (host == "localhost" || host == "127.0.0.1" || host == "[::1]") return true;
  if (host.size() > 2 && host.front() == '[' && host.back() == ']') host = host.substr(1, host.size() - 2);
  // A name can be pointed at us by anybody, an address in numbers cannot.
  return address_.is_loopback ? host == address_.host : is_numeric_address(host);
}

Access AccessRules::check(const RequestHead& head) const {
  if (head.method != "GET" && head.method != "HEAD") return Access::wrong_method;
  if (!knows_host(head.host)) return Access::wrong_host;
  if (!is_own_origin(head)) return Access::wrong_origin;
  return check_token(head);
}

Access AccessRules::check_viewer(const RequestHead& head) const {
  if (head.method != "GET") return Access::wrong_method;
  if (!knows_host(head.host)) return Access::wrong_host;
  if (!is_own_origin(head) && std::ranges::find(viewer_origins_, lower(head.origin)) == viewer_origins_.end())
    return Access::wrong_origin;
  const Access access = check_token(head);
  return access == Access::token_in_address ? Access::granted : access;
}

bool AccessRules::is_own_origin(const RequestHead& head) const {
  return head.origin.empty() || lower(head.origin) == "http://" + lower(head.host);
}

Access AccessRules::check_token(const RequestHead& head) const {
  if (token_.empty()) return Access::granted;
  constexpr std::string_view bearer = "Bearer ";
  if (head.authorization.starts_with(bearer) && same_secret(head.authorization.substr(bearer.size()), token_))
    return Access::granted;
  if (same_secret(cookie_value(head.cookie, cookie_name()), token_)) return Access::granted;
  return same_secret(query_value(head.target, "token"), token_) ? Access::token_in_address : Access::wrong_token;
}

std::string random_token() {
  std::array<unsigned char, 16> bytes{};
  if (::getrandom(bytes.data(), bytes.size(), 0) != static_cast<ssize_t>(bytes.size()))
    throw Error(Status::bad_config, "the system gives no random numbers for a token");
  std::string token;
  for (const unsigned char byte : bytes)
    for (const int digit : {byte >> 4, byte & 15}) token += "0123456789abcdef"[digit];
  return token;
}

std::string_view query_value(std::string_view target, std::string_view key) noexcept {
  const std::size_t question = target.find('?');
  std::string_view rest = question == std::string_view::npos ? std::string_view{} : target.substr(question + 1);
  while (!rest.empty()) {
    const std::size_t end = std::min(rest.find('&'), rest.size());
    const std::string_view pair = rest.substr(0, end);
    rest.remove_prefix(std::min(end + 1, rest.size()));
    if (pair.size() > key.size() && pair.starts_with(key) && pair[key.size()] == '=')
      return pair.substr(key.size() + 1);
  }
  return {};
}

}  // namespace lbea::tool
