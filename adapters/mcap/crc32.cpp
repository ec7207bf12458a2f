#include "adapters/mcap/bytes.hpp"

#include <isa-l/crc.h>

namespace lbea::mcap {
std::uint32_t crc32(Bytes bytes, std::uint32_t before) noexcept {
  if (bytes.empty()) return before;
  return crc32_gzip_refl(before, reinterpret_cast<const unsigned char*>(bytes.data()), bytes.size());
}
}  // namespace lbea::mcap
