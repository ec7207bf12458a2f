// What something may hide of a frame: where a sample's image is filled over at least five rows and columns and the
// frame's is empty. Narrower differences are differences of the silhouette.
#pragma once

#include "runtime/src/depth/depth_images.hpp"

namespace lbea {

class HiddenParts {
 public:
  /// Allocates all memory.
  explicit HiddenParts(const DepthCamera& camera);
  /// observed: padded_cells() values of the frame that samples are compared with. Does not allocate.
  void set_frame(std::span<const float> observed) noexcept;
  /// image: of a sample. Returns the number of cells that may be hidden. Does not allocate.
  std::size_t find(std::span<const std::uint16_t> image) noexcept;
  /// Calls visit(cell) for the last ones found.
  template <class Visit>
  void visit(const Visit& visit) const noexcept {
    for (std::size_t row = 0; row < rows_; ++row)
      for (std::size_t column = 0; column < columns_; ++column)
        if (parts_[at(row, column)] != 0) visit(row * columns_ + column);
  }

 private:
  static constexpr std::size_t width = 2 * Surroundings::reach + 1, margin = width - 1;  // cells
  [[nodiscard]] std::size_t at(std::size_t row, std::size_t column) const noexcept {
    return (row + margin) * stride_ + margin + column;
  }

  std::size_t columns_, rows_, stride_;
  // Per cell 1 or 0. Margins of zeros before and after all rows and columns; those beside a row and the next are one
  std::vector<std::uint8_t> empty_, differing_, pairs_, along_row_, parts_;
};

}  // namespace lbea
