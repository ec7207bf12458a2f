// Encodes and decodes messages. Decoding checks sizes, offsets, strides, types and counts before use. Every failure is
// a WireStatus; no content of a received message causes an exception.
#pragma once

#include "adapters/wire/codec/messages.hpp"

namespace lbea::wire {
enum class MessageKind : std::uint8_t { unknown, frame, result, state, control, inference };
/// Reads the file identifier only; the decoders check the rest.
[[nodiscard]] MessageKind message_kind(std::span<const std::byte> message) noexcept;

/// The fields of a frame apart from its points.
struct FrameHeader {
  std::uint64_t session = 0;
  std::uint64_t id = 0;
  std::int64_t stamp_ns = 0;
  std::uint32_t points = 0;
  bool end_of_stream = false;
  bool identified = false;    // session and id could be read (also from some rejected messages)
  std::string_view frame_id;  // names the coordinate system; valid until the decoder's next open()
  // The nested foxglove.PointCloud as received, for recordings; empty without one. Valid until the next open().
  std::span<const std::byte> cloud;
};

/// Decodes frames one after another with one set of buffers. Messages may begin at any address.
class FrameDecoder {
 public:
  explicit FrameDecoder(WireLimits limits = {}) : limits_(limits) {}
  /// Checks the whole message and reads its header. Returns ok, end_of_stream or the reason for rejection.
  [[nodiscard]] WireStatus open(std::span<const std::byte> message);
  [[nodiscard]] const FrameHeader& header() const noexcept { return header_; }
  /// Copies header().points points to the front of `into`. The last open() must have returned ok, and its message must
  /// still be alive.
  void read_points(std::span<Point> into) const noexcept;

 private:
  using Scratch = std::vector<std::uint64_t>;
  WireStatus open_cloud(std::span<const std::byte> cloud);
  WireLimits limits_;
  FrameHeader header_;
  std::span<const std::byte> data_;
  std::size_t stride_ = 0;
  std::array<std::size_t, 3> offsets_{};
  Scratch message_, cloud_;  // aligned copies of misaligned input
};

/// A frame that owns its points.
struct DecodedFrame {
  FrameHeader header;  // its frame_id is empty: see `coordinate_system`
  std::string coordinate_system;
  std::vector<Point> points;
};
/// FrameDecoder in one call.
[[nodiscard]] WireStatus decode_frame(std::span<const std::byte> message, DecodedFrame& into, WireLimits limits = {});

/// Encodes messages one after another into one buffer.
class Encoder {
 public:
  Encoder();
  ~Encoder();
  Encoder(Encoder&&) noexcept;
  Encoder& operator=(Encoder&&) noexcept;
  // Each returns the message, 8-byte aligned and valid until the next call.
  /// Empty when the stamp is before 1970 or after 2106, or when the points exceed a message (2 GB).
  std::span<const std::byte> frame(const Frame& frame, std::uint64_t session, std::string_view frame_id = "sensor");
  /// A frame that holds the given foxglove.PointCloud byte for byte; empty when it is too large.
  std::span<const std::byte> frame_of_cloud(std::span<const std::byte> cloud, std::uint64_t session, std::uint64_t id);
  std::span<const std::byte> end_of_stream(std::uint64_t session, std::uint64_t next_id);
  std::span<const std::byte> result(const WireResult& result);
  std::span<const std::byte> state(const WireState& state);
  std::span<const std::byte> control(const Control& control);
  std::span<const std::byte> inference(const WireInference& inference);

 private:
  struct Buffers;
  std::unique_ptr<Buffers> buffers_;
};

/// Replaces id and stamp of an encoded frame in place. `message` must come from Encoder::frame and begin at an address
/// divisible by 8; the stamp must be one that Encoder::frame accepts.
void relabel_frame(std::span<std::byte> message, std::uint64_t id, std::int64_t stamp_ns) noexcept;
/// Whether a stamp is in the range of the wire format: 1970 to 2106.
[[nodiscard]] bool is_sendable_stamp(std::int64_t stamp_ns) noexcept;
/// Whether so many points fit into one message (2 GB).
[[nodiscard]] bool is_sendable_count(std::size_t points) noexcept;

/// ok, or the reason for rejection (then `into` is unspecified).
[[nodiscard]] WireStatus decode_result(std::span<const std::byte> message, WireResult& into);
[[nodiscard]] WireStatus decode_state(std::span<const std::byte> message, WireState& into);
[[nodiscard]] WireStatus decode_control(std::span<const std::byte> message, Control& into);
[[nodiscard]] WireStatus decode_inference(std::span<const std::byte> message, WireInference& into);

// The compiled schemas of the messages (.bfbs bytes), for recordings and for viewers that decode with them.
[[nodiscard]] std::span<const std::byte> point_cloud_schema() noexcept;  // foxglove.PointCloud
[[nodiscard]] std::span<const std::byte> frame_schema() noexcept;        // lbea.wire.Frame
[[nodiscard]] std::span<const std::byte> result_schema() noexcept;       // lbea.wire.Result
[[nodiscard]] std::span<const std::byte> state_schema() noexcept;        // lbea.wire.State
}  // namespace lbea::wire
