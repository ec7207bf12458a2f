// ISA-L is faster, but much of it needs an assembler of its own, and Debian has it for this machine only.
#include "adapters/mcap/bytes.hpp"

#include <zlib.h>

namespace lbea::mcap {
std::uint32_t crc32(Bytes bytes, std::uint32_t before) noexcept {
  if (bytes.empty()) return before;
  return static_cast<std::uint32_t>(
      ::crc32_z(before, reinterpret_cast<const unsigned char*>(bytes.data()), bytes.size()));
}
}  // namespace lbea::mcap
