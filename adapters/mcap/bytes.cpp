#include "adapters/mcap/bytes.hpp"

#include "adapters/files/system_files.hpp"

#include <algorithm>

#include <zlib.h>

namespace lbea::mcap {
std::uint32_t crc32_joined(std::uint32_t first, std::uint32_t second, std::uint64_t second_bytes) noexcept {
  return static_cast<std::uint32_t>(crc32_combine(first, second, static_cast<z_off_t>(second_bytes)));
}

void MemorySource::read(std::uint64_t offset, std::span<std::byte> into) const {
  const auto from = bytes_.subspan(static_cast<std::size_t>(offset), into.size());
  std::copy(from.begin(), from.end(), into.begin());
}

FileSource::FileSource(const std::filesystem::path& path) : file_(path) {
  io::system::expect_sequential(file_.descriptor());
}
}  // namespace lbea::mcap
