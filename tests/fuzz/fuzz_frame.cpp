// Arbitrary bytes as a frame: refused, or read within their bounds.
#include "adapters/wire/codec/codec.hpp"

#include <cstdlib>

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static lbea::wire::FrameDecoder decoder({.max_points = 4096});
  static std::vector<lbea::Point> points(4096);
  const lbea::wire::WireStatus status = decoder.open(std::as_bytes(std::span{data, size}));
  if (status != lbea::wire::WireStatus::ok) return 0;
  if (decoder.header().points > points.size()) std::abort();
  decoder.read_points(points);
  std::size_t length = 0;
  for (const char letter : decoder.header().frame_id) length += letter != 0;
  if (length > size) std::abort();
  return 0;
}
