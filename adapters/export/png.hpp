// Pictures in memory and as PNG.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

namespace lbea::io {
using Color = std::array<std::uint8_t, 3>;  // red, green, blue

/// Rows from the top, pixels from the left.
struct Picture {
  Picture(std::uint32_t columns, std::uint32_t lines, const Color& background)
      : width(columns), height(lines), pixels(std::size_t{columns} * lines, background) {}
  [[nodiscard]] Color& at(std::uint32_t column, std::uint32_t line) {
    return pixels[std::size_t{line} * width + column];
  }
  std::uint32_t width, height;
  std::vector<Color> pixels;
};

/// The bytes of a PNG file with 8 bits per channel. Throws Error{bad_config} for a picture without pixels.
[[nodiscard]] std::string png_of(const Picture& picture);
}  // namespace lbea::io
