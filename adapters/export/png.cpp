#include "adapters/export/png.hpp"

#include <lbea/lbea.hpp>

#include <new>
#include <string_view>

#include <zlib.h>

namespace lbea::io {
namespace {

void append_number(std::string& to, std::uint32_t number) {  // most significant byte first
  for (int shift = 24; shift >= 0; shift -= 8) to += static_cast<char>(number >> static_cast<unsigned>(shift) & 0xFFu);
}

const Bytef* bytes_of(std::string_view text) { return reinterpret_cast<const Bytef*>(text.data()); }

/// Length of the data, name, data, CRC-32 of name and data.
void append_chunk(std::string& to, std::string_view name, std::string_view data) {
  append_number(to, static_cast<std::uint32_t>(data.size()));
  const std::size_t begin = to.size();
  to += name;
  to += data;
  const std::string_view covered = std::string_view(to).substr(begin);
  append_number(to, static_cast<std::uint32_t>(crc32(0, bytes_of(covered), static_cast<uInt>(covered.size()))));
}

/// Each row begins with its filter: 2, the difference from the row above, which compresses areas of one color best.
std::string filtered_rows(const Picture& picture) {
  constexpr char difference_from_above = 2;
  std::string rows;
  rows.reserve(picture.height * (std::size_t{picture.width} * 3 + 1));
  for (std::uint32_t y = 0; y < picture.height; ++y) {
    rows += difference_from_above;
    for (std::uint32_t x = 0; x < picture.width; ++x) {
      const Color& color = picture.pixels[std::size_t{y} * picture.width + x];
      const Color above = y == 0 ? Color{} : picture.pixels[std::size_t{y - 1} * picture.width + x];
      for (std::size_t k = 0; k < 3; ++k) rows += static_cast<char>(color[k] - above[k]);
    }
  }
  return rows;
}

std::string compressed(const std::string& text) {
  uLongf size = compressBound(text.size());
  std::string result(size, '\0');
  if (compress2(reinterpret_cast<Bytef*>(result.data()), &size, bytes_of(text), text.size(), Z_BEST_COMPRESSION) !=
      Z_OK)
    throw std::bad_alloc();  // the only possible error
  result.resize(size);
  return result;
}

}  // namespace

std::string png_of(const Picture& picture) {
  if (picture.pixels.empty()) throw Error(Status::bad_config, "a picture without pixels cannot be written");
  constexpr std::string_view signature("\x89PNG\r\n\x1a\n", 8);
  constexpr std::string_view depth_and_kind("\x08\x02\0\0\0", 5);  // 8 bits, RGB; deflate, filters, not interlaced
  std::string header;
  append_number(header, picture.width);
  append_number(header, picture.height);
  header += depth_and_kind;
  std::string png(signature);
  append_chunk(png, "IHDR", header);
  append_chunk(png, "IDAT", compressed(filtered_rows(picture)));
  append_chunk(png, "IEND", {});
  return png;
}

}  // namespace lbea::io
