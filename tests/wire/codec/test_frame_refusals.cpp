// Malformed and hostile frames, built field by field with the generated accessors.
#include "adapters/wire/codec/codec.hpp"

#include "frame_generated.h"

#include <doctest/doctest.h>

#include <array>
#include <cmath>
#include <cstring>
#include <string>
#include <vector>

using namespace lbea;
using namespace lbea::wire;
using foxglove::NumericType;

namespace {

struct Field {
  std::string name;
  std::uint32_t offset;
  NumericType type = NumericType::FLOAT32;
};

struct Cloud {
  std::uint32_t stride = 12;
  std::vector<Field> fields{{"x", 0}, {"y", 4}, {"z", 8}};
  std::vector<std::uint8_t> data = std::vector<std::uint8_t>(24);
  std::uint32_t nsec = 0;
  double shift = 0, turn = 0;  // of the pose, along and about the axis
  bool has_pose = false;
  std::size_t axis = 1;
};

std::vector<std::byte> finish(flatbuffers::FlatBufferBuilder& builder, const std::vector<std::uint8_t>& cloud) {
  builder.ForceVectorAlignment(cloud.size(), 1, 8);
  const auto nested = builder.CreateVector(cloud);
  schema::FinishFrameBuffer(builder, schema::CreateFrame(builder, 1, 2, nested));
  const auto bytes = std::as_bytes(std::span{builder.GetBufferPointer(), builder.GetSize()});
  return {bytes.begin(), bytes.end()};
}

std::vector<std::byte> encode(const Cloud& cloud) {
  flatbuffers::FlatBufferBuilder inner, outer;
  std::vector<flatbuffers::Offset<foxglove::PackedElementField>> fields;
  for (const Field& field : cloud.fields)
    fields.push_back(foxglove::CreatePackedElementFieldDirect(inner, field.name.c_str(), field.offset, field.type));
  flatbuffers::Offset<foxglove::Pose> pose;
  if (cloud.has_pose) {
    std::array<double, 3> shift{}, turn{};
    shift[cloud.axis] = cloud.shift, turn[cloud.axis] = cloud.turn;
    const auto position = foxglove::CreateVector3(inner, shift[0], shift[1], shift[2]);
    pose = foxglove::CreatePose(inner, position, foxglove::CreateQuaternion(inner, turn[0], turn[1], turn[2], 1));
  }
  const foxglove::Time time(1, cloud.nsec);
  inner.Finish(foxglove::CreatePointCloudDirect(inner, &time, "sensor", pose, cloud.stride, &fields, &cloud.data));
  return finish(outer, {inner.GetBufferPointer(), inner.GetBufferPointer() + inner.GetSize()});
}

WireStatus status_of(const Cloud& cloud, WireLimits limits = {}) {
  DecodedFrame frame;
  return decode_frame(encode(cloud), frame, limits);
}

/// `count` points of `stride` bytes, x at 1, y at 9, z at stride - 4, all else 0xaa.
Cloud odd_cloud(std::uint32_t stride, std::size_t count) {
  Cloud cloud{.stride = stride, .fields = {{"quality", 0, NumericType::UINT8}, {"z", stride - 4}, {"x", 1}, {"y", 9}}};
  cloud.data.assign(count * stride, 0xaa);
  for (std::size_t i = 0; i < count; ++i) {
    const Point point{static_cast<float>(i), static_cast<float>(2 * i), static_cast<float>(3 * i)};
    std::memcpy(&cloud.data[i * stride + 1], &point.x, 4);
    std::memcpy(&cloud.data[i * stride + 9], &point.y, 4);
    std::memcpy(&cloud.data[i * stride + stride - 4], &point.z, 4);
  }
  return cloud;
}

}  // namespace

TEST_CASE("odd strides and extra fields, in any order") {
  for (const std::uint32_t stride : {17u, 20u, 31u, 64u}) {
    CAPTURE(stride);
    DecodedFrame frame;
    REQUIRE(decode_frame(encode(odd_cloud(stride, 5)), frame) == WireStatus::ok);
    REQUIRE(frame.points.size() == 5);
    for (std::size_t i = 0; i < 5; ++i) {
      CHECK(frame.points[i].x == static_cast<float>(i));
      CHECK(frame.points[i].y == static_cast<float>(2 * i));
      CHECK(frame.points[i].z == static_cast<float>(3 * i));
    }
  }
}

TEST_CASE("fields: one float32 each of x, y and z") {
  CHECK(status_of({}) == WireStatus::ok);
  CHECK(status_of({.fields = {}}) == WireStatus::bad_fields);
  CHECK(status_of({.fields = {{"x", 0}, {"y", 4}}}) == WireStatus::bad_fields);
  CHECK(status_of({.fields = {{"x", 0}, {"y", 4}, {"Z", 8}}}) == WireStatus::bad_fields);
  CHECK(status_of({.fields = {{"x", 0}, {"x", 0}, {"y", 4}, {"z", 8}}}) == WireStatus::bad_fields);
  for (int type = 0; type < 12; ++type) {
    CAPTURE(type);
    const auto numeric = static_cast<NumericType>(type);
    const auto expected = numeric == NumericType::FLOAT32 ? WireStatus::ok : WireStatus::bad_fields;
    CHECK(status_of({.stride = 24, .fields = {{"x", 0, numeric}, {"y", 8}, {"z", 16}}}) == expected);
  }
}

TEST_CASE("layout: fields inside the stride, the stride divides the data") {
  CHECK(status_of({.stride = 0}) == WireStatus::bad_layout);
  CHECK(status_of({.stride = 3}) == WireStatus::bad_layout);
  CHECK(status_of({.stride = 11, .data = std::vector<std::uint8_t>(22)}) == WireStatus::bad_layout);
  CHECK(status_of({.data = std::vector<std::uint8_t>(25)}) == WireStatus::bad_layout);
  CHECK(status_of({.fields = {{"x", 0}, {"y", 4}, {"z", 9}}}) == WireStatus::bad_layout);
  CHECK(status_of({.fields = {{"x", 0}, {"y", 4}, {"z", 0xffff'fffe}}}) == WireStatus::bad_layout);
  CHECK(status_of({.stride = 0xffff'ffff}) == WireStatus::bad_layout);
  CHECK(status_of({.data = {}}) == WireStatus::ok);  // empty: the matcher says so
}

TEST_CASE("too many points, too many bytes") {
  CHECK(status_of({.data = std::vector<std::uint8_t>(12 * 10)}, {.max_points = 10}) == WireStatus::ok);
  CHECK(status_of({.data = std::vector<std::uint8_t>(12 * 11)}, {.max_points = 10}) == WireStatus::too_many_points);
  CHECK(Encoder().frame({1, 1, {}}, 1, std::string(65'537, 'x')).empty());  // a frame's name is no place for a file
  const std::vector<Point> ten_million(10'000'000);
  Encoder encoder;
  FrameDecoder decoder({.least_message_bytes = 0});
  const auto message = encoder.frame({1, 1, ten_million}, 1);
  REQUIRE(message.size() > 120'000'000);
  // Regression: such a frame never reached the decoder; the socket disconnected its sender without counting it.
  CHECK(FrameDecoder().open(message) == WireStatus::too_many_points);
  CHECK(decoder.open(message) == WireStatus::message_too_large);
  CHECK_FALSE(decoder.header().identified);
  CHECK(FrameDecoder({.max_points = 9'999'999}).open(message) == WireStatus::too_many_points);
}

TEST_CASE("stamps and poses") {
  CHECK(status_of({.nsec = 999'999'999}) == WireStatus::ok);
  CHECK(status_of({.nsec = 1'000'000'000}) == WireStatus::bad_stamp);
  CHECK(status_of({.has_pose = true}) == WireStatus::ok);
  for (const std::size_t axis : {0u, 1u, 2u}) {
    CHECK(status_of({.shift = 1e-9, .has_pose = true, .axis = axis}) == WireStatus::unsupported_pose);
    CHECK(status_of({.turn = 0.1, .has_pose = true, .axis = axis}) == WireStatus::unsupported_pose);
  }
  CHECK(status_of({.shift = std::nan(""), .has_pose = true}) == WireStatus::unsupported_pose);
}

TEST_CASE("messages that are not frames") {
  FrameDecoder decoder;
  CHECK(decoder.open({}) == WireStatus::wrong_kind);
  const std::vector<std::byte> zeros(1000);
  CHECK(decoder.open(zeros) == WireStatus::wrong_kind);
  Encoder encoder;
  CHECK(decoder.open(encoder.result({})) == WireStatus::wrong_kind);
  CHECK(decoder.open(encoder.state({})) == WireStatus::wrong_kind);
}

TEST_CASE("the nested cloud is checked separately and may be misaligned") {
  flatbuffers::FlatBufferBuilder none, garbage;
  schema::FinishFrameBuffer(none, schema::CreateFrame(none, 1, 2));
  FrameDecoder decoder;
  CHECK(decoder.open(std::as_bytes(std::span{none.GetBufferPointer(), none.GetSize()})) == WireStatus::bad_cloud);
  CHECK(decoder.header().identified);
  CHECK(decoder.header().id == 2);
  CHECK(decoder.open(finish(garbage, std::vector<std::uint8_t>(100, 0x7f))) == WireStatus::bad_cloud);
  flatbuffers::FlatBufferBuilder empty, around;  // some writers leave empty vectors out
  std::vector<flatbuffers::Offset<foxglove::PackedElementField>> fields;
  for (const char* name : {"x", "y", "z"})
    fields.push_back(foxglove::CreatePackedElementFieldDirect(
        empty, name, static_cast<std::uint32_t>(4 * fields.size()), NumericType::FLOAT32));
  empty.Finish(foxglove::CreatePointCloudDirect(empty, nullptr, nullptr, 0, 12, &fields, nullptr));
  CHECK(decoder.open(finish(around, {empty.GetBufferPointer(), empty.GetBufferPointer() + empty.GetSize()})) ==
        WireStatus::ok);
  CHECK(decoder.header().points == 0);

  Encoder encoder;
  const std::vector<Point> points{{1, 2, 3}};
  const auto good = encoder.frame({2, 3, points}, 1);
  const auto* cloud = flatbuffers::GetRoot<schema::Frame>(good.data())->cloud();
  for (std::size_t shift = 0; shift < 8; ++shift) {  // the inner buffer may lie anywhere in the message
    CAPTURE(shift);
    flatbuffers::FlatBufferBuilder outer;
    outer.CreateVector(std::vector<std::uint8_t>(shift));
    const auto nested = outer.CreateVector(cloud->data(), cloud->size());
    schema::FinishFrameBuffer(outer, schema::CreateFrame(outer, 1, 2, nested));
    CHECK(decoder.open(std::as_bytes(std::span{outer.GetBufferPointer(), outer.GetSize()})) == WireStatus::ok);
  }
}

TEST_CASE("a frame truncated at any byte is rejected, or lacks only padding") {
  const std::vector<Point> points(20, Point{1, 2, 3});
  Encoder encoder;
  const auto message = encoder.frame({1, 1, points}, 1);
  constexpr std::size_t most_padding = 7;
  for (std::size_t length = 0; length < message.size(); ++length) {
    CAPTURE(length);
    const std::vector<std::byte> cut(message.begin(), message.begin() + static_cast<std::ptrdiff_t>(length));
    DecodedFrame frame;
    const WireStatus status = decode_frame(cut, frame);
    if (status == WireStatus::ok) {
      CHECK(length + most_padding >= message.size());
      CHECK(std::memcmp(frame.points.data(), points.data(), sizeof(Point) * points.size()) == 0);
    } else {
      CHECK(status == (length < 8 ? WireStatus::wrong_kind : WireStatus::damaged));
    }
  }
}

TEST_CASE("a frame with any flipped bit is rejected or read within its bounds") {
  const std::vector<Point> points(20, Point{1, 2, 3});
  Encoder encoder;
  const auto message = encoder.frame({1, 1, points}, 1);
  std::size_t accepted = 0;
  for (std::size_t bit = 0; bit < message.size() * 8; ++bit) {
    std::vector<std::byte> flipped(message.begin(), message.end());
    flipped[bit / 8] ^= std::byte{1} << (bit % 8);
    DecodedFrame frame;
    const WireStatus status = decode_frame(flipped, frame);
    CHECK(frame.points.size() <= points.size());
    CHECK((status == WireStatus::ok || frame.points.empty()));
    accepted += status == WireStatus::ok;
  }
  // Flipped bits in points, ids and stamp cannot be detected here: transports have checksums.
  CHECK(accepted >= points.size() * sizeof(Point) * 8);
  CHECK(accepted < message.size() * 8);
}
