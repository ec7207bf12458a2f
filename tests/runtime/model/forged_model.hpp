// Models with other contents than were baked, whose checksums fit all the same.
#pragma once

#include "runtime/src/model/checksum.hpp"
#include "runtime/src/model/model_view.hpp"
#include "tests/support/refusals.hpp"

#include <cstring>
#include <span>
#include <string>

namespace lbea::test {

inline Status status_of(std::span<const std::byte> image) {
  const Error error = error_of([&] { const Model model = Model::view(image); });
  if (error.status != Status::ok) CHECK(std::string(error.what()).size() > 20);
  return error.status;
}

inline bool is_refusal(Status status) {
  return status == Status::not_a_model || status == Status::corrupt_model || status == Status::unsupported_version;
}

inline format::Header header_of(std::span<const std::byte> image) {
  format::Header header;
  std::memcpy(&header, image.data(), sizeof(header));
  return header;
}

// Writes a header back with a checksum that fits: what follows the checksum test is then tested itself.
inline void put_header(std::span<std::byte> image, format::Header header) {
  header.header_checksum =
      checksum(std::as_bytes(std::span(&header, 1)).first(offsetof(format::Header, header_checksum)));
  std::memcpy(image.data(), &header, sizeof(header));
}

// Changes a directory entry, and a section's bytes, and makes all checksums fit again.
template <typename Change>
void forge(std::span<std::byte> image, format::SectionId id, Change change) {
  format::Header header = header_of(image);
  const auto directory = image.subspan(sizeof(header), header.section_count * sizeof(format::SectionEntry));
  for (std::size_t at = 0; at < directory.size(); at += sizeof(format::SectionEntry)) {
    format::SectionEntry entry;
    std::memcpy(&entry, &directory[at], sizeof(entry));
    if (entry.id != static_cast<std::uint32_t>(id)) continue;
    const auto section = image.subspan(entry.offset, entry.length);
    change(entry, section);
    if (entry.offset <= image.size() && entry.length <= image.size() - entry.offset)
      entry.checksum = checksum(image.subspan(entry.offset, entry.length));
    std::memcpy(&directory[at], &entry, sizeof(entry));
  }
  header.directory_checksum = checksum(directory);
  put_header(image, header);
}

template <typename T>
void set(std::span<std::byte> section, std::size_t index, T value) {
  REQUIRE((index + 1) * sizeof(T) <= section.size());
  std::memcpy(&section[index * sizeof(T)], &value, sizeof(T));
}

}  // namespace lbea::test
