#include "adapters/http/metrics.hpp"

#include <lbea/lbea.hpp>

#include <nlohmann/json.hpp>

#include <charconv>
#include <cmath>

namespace lbea::http {
namespace {
template <class Value>
std::string number(Value value) {
  if (std::isnan(value)) return "NaN";
  if (std::isinf(value)) return value > 0 ? "+Inf" : "-Inf";
  std::array<char, 32> digits;
  const auto [end, error] = std::to_chars(digits.data(), digits.data() + digits.size(), value);
  return {digits.data(), end};
}

/// File names may contain any bytes; the page is UTF-8.
std::string as_utf8(std::string_view text) {
  using Json = nlohmann::json;
  return Json::parse(Json(text).dump(-1, ' ', false, Json::error_handler_t::replace)).get<std::string>();
}

/// The format escapes backslashes and line breaks everywhere, and quotes in labels.
std::string escaped(std::string_view text, bool is_label) {
  std::string escaped;
  for (const char c : text) {
    if (c == '\\' || (is_label && c == '"')) escaped += '\\';
    escaped += c == '\n' ? std::string("\\n") : std::string(1, c);
  }
  return escaped;
}

Address local_address(const std::string& text) {
  Address address = parse_address(text, "--metrics");
  if (!address.is_loopback)
    throw Error{Status::bad_config, "--metrics \"" + text +
                                        "\": other machines could read the metrics without authentication; only this "
                                        "machine may, e.g. 127.0.0.1:9464"};
  return address;
}

/// DNS rebinding lets a foreign page that is open in a browser of this machine send requests under its own host name.
bool is_local_name(std::string_view host) {
  const std::string name(host_name(host));
  return name.empty() || name == "localhost" || is_loopback_address(name);
}
}  // namespace

MetricsText& MetricsText::metric(std::string_view name, std::string_view type, std::string_view help) {
  name_ = name;
  text_ += "# HELP " + name_ + " " + escaped(help, false) + "\n# TYPE " + name_ + " " + std::string(type) + "\n";
  return *this;
}

MetricsText& MetricsText::value(std::uint64_t value, std::string_view labels) {
  line({}, labels, std::to_string(value));
  return *this;
}

MetricsText& MetricsText::value(double value, std::string_view labels) {
  line({}, labels, number(value));
  return *this;
}

MetricsText& MetricsText::value(float value, std::string_view labels) {
  line({}, labels, number(value));
  return *this;
}

MetricsText& MetricsText::histogram(std::string_view name, std::string_view help, std::span<const double> bounds,
                                    std::span<const std::uint64_t> counts, double sum) {
  metric(name, "histogram", help);
  std::uint64_t so_far = 0;
  for (std::size_t i = 0; i < counts.size(); ++i) {
    so_far += counts[i];
    line("_bucket", label("le", i < bounds.size() ? number(bounds[i]) : "+Inf"), std::to_string(so_far));
  }
  line("_sum", {}, number(sum));
  line("_count", {}, std::to_string(so_far));
  return *this;
}

std::string MetricsText::label(std::string_view name, std::string_view value) {
  return std::string(name) + "=\"" + escaped(as_utf8(value), true) + "\"";
}

void MetricsText::line(std::string_view suffix, std::string_view labels, const std::string& value) {
  text_ += name_ + std::string(suffix);
  if (!labels.empty()) text_ += "{" + std::string(labels) + "}";
  text_ += " " + value + "\n";
}

MetricsServer::MetricsServer(const std::string& address, std::function<std::string()> page)
    : page_(std::move(page)), server_(local_address(address), {}) {
  server_.start(*this);
}

Response MetricsServer::respond(const Request& request) {
  Response response{200, "text/plain; version=0.0.4; charset=utf-8", {}, {{"X-Content-Type-Options", "nosniff"}}, true};
  if (!is_local_name(request.host))
    response.status = 403;
  else if (request.method != "GET" && request.method != "HEAD")
    response.status = 405;
  else if (request.path() != "/metrics" && request.path() != "/")
    response.status = 404;
  else
    response.body = page_();
  return response;
}
}  // namespace lbea::http
