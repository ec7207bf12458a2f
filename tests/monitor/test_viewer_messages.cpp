// Messages of Foxglove viewers, and the access rules.
#include "tests/support/refusals.hpp"
#include "tools/monitor/web/access.hpp"
#include "tools/monitor/web/foxglove.hpp"

#include <doctest/doctest.h>
#include <nlohmann/json.hpp>

using namespace lbea;
using namespace lbea::tool;
using namespace lbea::test;
using nlohmann::json;

namespace {

const AccessRules rules({"127.0.0.1", 8080, true}, {"Rig.Lab"}, "", {"https://Viewer.example"});
const AccessRules guarded({"192.168.0.7", 80, false}, {}, "0123", {});

http::Request from(std::string_view host, std::string_view origin = {}, std::string_view method = "GET") {
  return {method, "/", host, origin, {}, {}};
}

}  // namespace

TEST_CASE("subprotocols: the first supported one that is offered") {
  CHECK(viewer_subprotocol("foxglove.sdk.v1") == "foxglove.sdk.v1");
  CHECK(viewer_subprotocol("x,  foxglove.websocket.v1  ,y") == "foxglove.websocket.v1");
  CHECK(viewer_subprotocol("foxglove.websocket.v1, foxglove.sdk.v1") == "foxglove.sdk.v1");
  for (const char* other : {"", ",", " , ,", "foxglove.sdk.v10", "foxglove"}) CHECK(viewer_subprotocol(other).empty());
}

TEST_CASE("subscriptions: errors are reported, the rest of the message is applied") {
  ViewerSubscriptions viewer;
  CHECK(viewer.apply(R"({"op":"subscribe","subscriptions":[{"id":7,"channelId":0},{"id":8,"channelId":2}]})").empty());
  const auto refuses = [&](const std::string& message, const std::string& words) {
    CAPTURE(message);
    CHECK(contains(viewer.apply(message), words));
  };
  refuses(R"({"op":"subscribe","subscriptions":[{"id":9,"channelId":99}]})", "no channel with that number");
  refuses(R"({"op":"subscribe","subscriptions":[{"id":7,"channelId":1}]})", "subscription number is in use");
  refuses(R"({"op":"subscribe","subscriptions":[{"id":9,"channelId":0}]})", "has a subscription already");
  refuses(R"({"op":"subscribe","subscriptions":[{"id":-1,"channelId":1},{"channelId":1},7]})", "needs the numbers");
  refuses(R"({"op":"subscribe","subscriptions":[{"id":4294967296,"channelId":1}]})", "needs the numbers");
  refuses(R"({"op":"subscribe","subscriptions":{}})", "supports only subscribe and unsubscribe");
  refuses(R"({"op":"unsubscribe","subscriptionIds":[5]})", "no subscription with that number");
  refuses(R"({"op":"unsubscribe","subscriptionIds":["8"]})", "identified by a number");
  refuses(R"({"op":"unsubscribe","subscriptionIds":8})", "supports only subscribe and unsubscribe");
  refuses(R"({"op":"advertise"})", "no other capabilities");
  refuses(R"({"op":1})", "not a JSON object with an op");
  refuses("[1]", "not a JSON object with an op");
  refuses("{\"op\"", "not a JSON object with an op");
  CHECK(viewer.apply(R"({"op":"unsubscribe","subscriptionIds":[7,8]})").empty());
  CHECK(viewer.apply(R"({"op":"subscribe","subscriptions":[{"id":7,"channelId":2}]})").empty());
}

TEST_CASE("the greeting lists all channels, notices are JSON, headers are little-endian") {
  const auto [info, channels] = viewer_greeting("abc");
  CHECK(json::parse(info)["sessionId"] == "abc");
  const json advertised = json::parse(channels)["channels"];
  REQUIRE(advertised.size() == 3);
  for (const json& channel : advertised) CHECK(channel["schema"].get<std::string>().size() % 4 == 0);
  CHECK(json::parse(viewer_notice(ViewerNotice::warning, "a \"b\""))["message"] == "a \"b\"");
  const auto head = viewer_head(0x04030201, 0x0807060504030201);
  for (std::size_t i = 0; i < 4; ++i) CHECK(head[1 + i] == static_cast<char>(1 + i));
  for (std::size_t i = 0; i < 8; ++i) CHECK(head[5 + i] == static_cast<char>(1 + i));
}

TEST_CASE("hosts and origins: only our own, in any case of letters") {
  for (const char* ours : {"127.0.0.1:8080", "localhost:8080", "LOCALHOST:8080", "[::1]:8080", "rig.lab:8080"})
    CHECK(rules.check(from(ours)) == Access::granted);
  for (const char* other :
       {"", "127.0.0.1", "127.0.0.1:80", "rig.lab.evil:8080", "127.0.0.2:8080", "[::2]:8080", "[]:8080", ":8080"})
    CHECK(rules.check(from(other)) == Access::wrong_host);
  CHECK(rules.check(from("localhost:8080", "http://LocalHost:8080")) == Access::granted);
  CHECK(rules.check(from("localhost:8080", "https://viewer.example")) == Access::wrong_origin);
  CHECK(rules.check(from("localhost:8080", "", "POST")) == Access::wrong_method);
  CHECK(rules.check(from("localhost:8080", "", "HEAD")) == Access::granted);
  CHECK(rules.check_viewer(from("localhost:8080", "https://viewer.EXAMPLE")) == Access::granted);
  CHECK(rules.check_viewer(from("localhost:8080", "http://localhost:8080")) == Access::granted);
  CHECK(rules.check_viewer(from("localhost:8080", "https://evil.example")) == Access::wrong_origin);
  CHECK(rules.check_viewer(from("evil:8080")) == Access::wrong_host);
  CHECK(rules.check_viewer(from("localhost:8080", "", "HEAD")) == Access::wrong_method);
  for (const Access access : {Access::wrong_method, Access::wrong_host, Access::wrong_origin, Access::wrong_token})
    CHECK(!explain(access).empty());
  CHECK(explain(Access::granted).empty());
}

TEST_CASE("tokens: in the address, in a cookie or as a bearer token; port 80 may be omitted") {
  const auto with = [](std::string_view host, std::string_view target, std::string_view cookie,
                       std::string_view authorization) {
    return guarded.check({"GET", target, host, {}, cookie, authorization});
  };
  CHECK(with("192.168.0.7", "/", "", "") == Access::wrong_token);
  CHECK(with("10.0.0.1", "/?token=0123", "", "") == Access::token_in_address);  // a numeric address cannot be rebound
  CHECK(with("[fe80::1]", "/?a&token=&b=c&token=0123", "", "") == Access::wrong_token);
  CHECK(with("rig", "/?token=0123", "", "") == Access::wrong_host);
  CHECK(with("192.168.0.7:80", "/", "a; b=c; lbea_monitor_80=0123", "") == Access::granted);
  CHECK(with("192.168.0.7:80", "/", "lbea_monitor_80", "") == Access::wrong_token);
  CHECK(with("192.168.0.7:80", "/", "lbea_monitor_80x0123", "Bearer 0124") == Access::wrong_token);
  CHECK(with("192.168.0.7:80", "/", "", "Bearer 0123") == Access::granted);
  CHECK(with("192.168.0.7:80", "/", "", "Basic 0123") == Access::wrong_token);
  CHECK(guarded.check_viewer({"GET", "/?token=0123", "192.168.0.7", {}, {}, {}}) == Access::granted);
  CHECK(guarded.check_viewer({"GET", "/", "192.168.0.7", {}, {}, {}}) == Access::wrong_token);
  CHECK(http::query_value("/path", "a").empty());
  CHECK(http::query_value("/?ab=1&a=2", "a") == "2");
  CHECK(error_of([] { AccessRules({"0.0.0.0", 1, false}, {}, ""); }).status == Status::bad_config);
}
