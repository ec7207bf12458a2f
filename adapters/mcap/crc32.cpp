#include "adapters/mcap/crc32.hpp"

#include <isa-l/crc.h>
#include <zlib.h>

namespace lbea::mcap {

std::uint32_t crc32(Bytes bytes, std::uint32_t before) noexcept {
  if (bytes.empty()) return before;
  return crc32_gzip_refl(before, reinterpret_cast<const unsigned char*>(bytes.data()), bytes.size());
}

std::uint32_t crc32_joined(std::uint32_t first, std::uint32_t second, std::uint64_t second_bytes) noexcept {
  return static_cast<std::uint32_t>(crc32_combine(first, second, static_cast<z_off_t>(second_bytes)));
}

}  // namespace lbea::mcap
