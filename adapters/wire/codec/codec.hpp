// Messages to bytes and back. Decoding trusts nothing: sizes, offsets, strides, types and counts are checked
// before use, and every failure is a WireStatus; nothing here throws over what a peer sent.
#pragma once

#include "adapters/wire/codec/messages.hpp"

#include <memory>
#include <span>
#include <string_view>
#include <vector>

namespace lbea::wire {

enum class MessageKind : std::uint8_t { unknown, frame, result, state, control, inference };
/// By the file identifier alone; the decoders check the rest.
[[nodiscard]] MessageKind message_kind(std::span<const std::byte> message) noexcept;

/// What a frame says about itself beside its points.
struct FrameHeader {
  std::uint64_t session = 0;
  std::uint64_t id = 0;
  std::int64_t stamp_ns = 0;
  std::uint32_t points = 0;
  bool end_of_stream = false;
  bool identified = false;    // session and id could be read (also from some messages that are refused)
  std::string_view frame_id;  // names the coordinate system; valid until the decoder's next open()
  // The nested foxglove.PointCloud as it came, for recordings; empty when it is none. As long valid.
  std::span<const std::byte> cloud;
};

/// Reads frames one after another with one set of buffers. Messages may lie at any address.
class FrameDecoder {
 public:
  explicit FrameDecoder(WireLimits limits = {}) : limits_(limits) {}
  /// Checks the whole message and reads its header. Returns ok, end_of_stream or why the message is refused.
  [[nodiscard]] WireStatus open(std::span<const std::byte> message);
  [[nodiscard]] const FrameHeader& header() const noexcept { return header_; }
  /// Copies the points of the message that open() found ok, which must still be alive, to the front of
  /// `into`: header().points of them.
  void read_points(std::span<Point> into) const noexcept;

 private:
  using Scratch = std::vector<std::uint64_t>;
  WireStatus open_cloud(std::span<const std::byte> cloud);
  WireLimits limits_;
  FrameHeader header_;
  std::span<const std::byte> data_;
  std::size_t stride_ = 0;
  std::array<std::size_t, 3> offsets_{};
  Scratch message_, cloud_;  // copies of what lies too crookedly to be read in place
};

/// A frame that owns its points.
struct DecodedFrame {
  FrameHeader header;  // its frame_id is empty: see `coordinate_system`
  std::string coordinate_system;
  std::vector<Point> points;
};
/// FrameDecoder in one call.
[[nodiscard]] WireStatus decode_frame(std::span<const std::byte> message, DecodedFrame& into, WireLimits limits = {});

/// Writes messages one after another into one buffer.
class Encoder {
 public:
  Encoder();
  ~Encoder();
  Encoder(Encoder&&) noexcept;
  Encoder& operator=(Encoder&&) noexcept;
  // Each returns the message, valid until the next call, 8-byte aligned.
  /// Empty when the stamp is before 1970 or after 2106, or for more points than fit into a message (2 GB).
  std::span<const std::byte> frame(const Frame& frame, std::uint64_t session, std::string_view frame_id = "sensor");
  /// A frame around a complete foxglove.PointCloud, which it holds byte for byte; empty when that is too large.
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

/// Gives an encoded frame another id and stamp, in place. `message` must come from Encoder::frame and lie at
/// an address divisible by 8; the stamp must be one that Encoder::frame accepts.
void relabel_frame(std::span<std::byte> message, std::uint64_t id, std::int64_t stamp_ns) noexcept;
/// Whether a stamp fits on the wire: 1970 to 2106.
[[nodiscard]] bool is_sendable_stamp(std::int64_t stamp_ns) noexcept;

/// ok, or why the message is refused (then `into` is unspecified).
[[nodiscard]] WireStatus decode_result(std::span<const std::byte> message, WireResult& into);
[[nodiscard]] WireStatus decode_state(std::span<const std::byte> message, WireState& into);
[[nodiscard]] WireStatus decode_control(std::span<const std::byte> message, Control& into);
[[nodiscard]] WireStatus decode_inference(std::span<const std::byte> message, WireInference& into);

}  // namespace lbea::wire
