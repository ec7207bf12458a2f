#include "adapters/wire/codec/codec.hpp"

#include "frame_generated.h"

#include <doctest/doctest.h>

#include <cmath>
#include <cstring>
#include <limits>

using namespace lbea;
using namespace lbea::wire;

namespace {

std::vector<Point> some_points(std::size_t count) {
  std::vector<Point> points(count);
  for (std::size_t i = 0; i < count; ++i) {
    const auto t = static_cast<float>(i);
    points[i] = {t, -0.5f * t, 1e-3f * t};
  }
  return points;
}

bool same_bits(std::span<const Point> a, std::span<const Point> b) {
  return a.size() == b.size() && (a.empty() || std::memcmp(a.data(), b.data(), a.size_bytes()) == 0);
}

std::vector<std::byte> encode(const Frame& frame, std::uint64_t session = 7) {
  Encoder encoder;
  const auto message = encoder.frame(frame, session);
  return {message.begin(), message.end()};
}

}  // namespace

TEST_CASE("a frame of any size is decoded unchanged") {
  for (const std::size_t count : {0u, 1u, 2u, 3u, 17u, 62'000u}) {
    CAPTURE(count);
    const auto points = some_points(count);
    const auto message = encode({42, 1'234'567'890'123'456'789, points}, 0xfeed'beef'0000'0001);
    CHECK(message_kind(message) == MessageKind::frame);
    DecodedFrame frame;
    REQUIRE(decode_frame(message, frame) == WireStatus::ok);
    CHECK(frame.header.session == 0xfeed'beef'0000'0001);
    CHECK(frame.header.id == 42);
    CHECK(frame.header.stamp_ns == 1'234'567'890'123'456'789);
    CHECK(frame.header.points == count);
    CHECK(frame.coordinate_system == "sensor");
    CHECK(same_bits(frame.points, points));
  }
}

TEST_CASE("a recorded cloud is sent again byte for byte, with a given session and id") {
  for (const std::size_t count : {0u, 1u, 1000u}) {
    const auto points = some_points(count);
    const auto message = encode({0, 77, points}, 5);
    FrameDecoder decoder;
    REQUIRE(decoder.open(message) == WireStatus::ok);
    const std::vector<std::byte> cloud(decoder.header().cloud.begin(), decoder.header().cloud.end());
    CHECK(cloud.size() > count * sizeof(Point));
    Encoder encoder;
    const auto again = encoder.frame_of_cloud(cloud, 5, 0);
    CHECK(std::vector<std::byte>(again.begin(), again.end()) == message);
    REQUIRE(decoder.open(encoder.frame_of_cloud(cloud, 8, 1ull << 60)) == WireStatus::ok);
    CHECK(decoder.header().session == 8);
    CHECK(decoder.header().id == 1ull << 60);
    CHECK(decoder.header().stamp_ns == 77);
    const auto same = decoder.header().cloud;
    CHECK(std::vector<std::byte>(same.begin(), same.end()) == cloud);
  }
  FrameDecoder decoder;
  Encoder encoder;
  CHECK(decoder.open(encoder.frame_of_cloud({}, 1, 2)) == WireStatus::bad_cloud);
  CHECK(decoder.header().cloud.empty());
}

TEST_CASE("points that are not finite are decoded unchanged: the matcher counts them") {
  const float nan = std::numeric_limits<float>::quiet_NaN();
  const float infinity = std::numeric_limits<float>::infinity();
  const std::vector<Point> points{{nan, 1, 2}, {3, infinity, 4}, {5, 6, -infinity}};
  DecodedFrame frame;
  REQUIRE(decode_frame(encode({0, 0, points}), frame) == WireStatus::ok);
  CHECK(same_bits(frame.points, points));
}

TEST_CASE("a message may begin at any address") {
  const auto points = some_points(100);
  const auto message = encode({9, 1, points});
  std::vector<std::uint64_t> aligned(message.size() / 8 + 4);
  auto* base = reinterpret_cast<std::byte*>(aligned.data());
  FrameDecoder decoder;
  std::vector<Point> into(100);
  for (std::size_t shift = 0; shift < 16; ++shift) {
    CAPTURE(shift);
    std::memcpy(base + shift, message.data(), message.size());
    REQUIRE(decoder.open({base + shift, message.size()}) == WireStatus::ok);
    CHECK(decoder.header().id == 9);
    decoder.read_points(into);
    CHECK(same_bits(into, points));
  }
}

TEST_CASE("the decoder copies no more points than the destination holds") {
  const auto points = some_points(10);
  const auto message = encode({0, 0, points});
  FrameDecoder decoder;
  REQUIRE(decoder.open(message) == WireStatus::ok);
  std::vector<Point> few(4);
  decoder.read_points(few);
  CHECK(same_bits(few, std::span(points).first(4)));
}

TEST_CASE("an end of stream carries session and id, and no points") {
  Encoder encoder;
  FrameDecoder decoder;
  CHECK(decoder.open(encoder.end_of_stream(5, 100)) == WireStatus::end_of_stream);
  CHECK(decoder.header().end_of_stream);
  CHECK(decoder.header().session == 5);
  CHECK(decoder.header().id == 100);
  CHECK(decoder.header().points == 0);
}

TEST_CASE("relabel_frame changes only id and stamp") {
  const auto points = some_points(5);
  auto message = encode({0, 0, points});
  relabel_frame(message, std::numeric_limits<std::uint64_t>::max(), 5'000'000'007);
  CHECK(message == encode({std::numeric_limits<std::uint64_t>::max(), 5'000'000'007, points}));
  relabel_frame(message, 0, 0);
  CHECK(message == encode({0, 0, points}));
}

TEST_CASE("stamps from 1970 to 2106 are encoded, others are not") {
  constexpr std::int64_t last = 4'294'967'295'999'999'999;
  CHECK(is_sendable_stamp(0));
  CHECK(is_sendable_stamp(last));
  CHECK_FALSE(is_sendable_stamp(last + 1));
  CHECK_FALSE(is_sendable_stamp(-1));
  Encoder encoder;
  CHECK(encoder.frame({0, -1, {}}, 0).empty());
  DecodedFrame frame;
  REQUIRE(decode_frame(encode({0, last, {}}), frame) == WireStatus::ok);
  CHECK(frame.header.stamp_ns == last);
}

TEST_CASE("an encoder can be reused") {
  Encoder encoder;
  const auto many = some_points(1000), few = some_points(3);
  const auto first = encode({1, 1, few});
  static_cast<void>(encoder.frame({0, 0, many}, 1));
  static_cast<void>(encoder.end_of_stream(1, 1));
  const auto again = encoder.frame({1, 1, few}, 7);
  CHECK(std::equal(again.begin(), again.end(), first.begin(), first.end()));
}

TEST_CASE("the embedded schemas are those of the messages") {
  for (const auto schema : {point_cloud_schema(), frame_schema(), result_schema(), state_schema()}) {
    REQUIRE(schema.size() > 100);
    CHECK(std::memcmp(schema.data() + 4, "BFBS", 4) == 0);
  }
}
