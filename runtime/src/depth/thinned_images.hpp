// The samples whose depth images are most similar to a frame's, by every fourth cell of rows and columns.
#pragma once

#include "runtime/src/depth/image_comparison.hpp"

namespace lbea {

/// Every fourth cell of rows and columns that any sample fills.
[[nodiscard]] std::vector<std::uint32_t> thinned_cells(const DepthImages& images);

/// Compares samples by these cells of their images: up to `most_compared` samples one by one. More are divided into
/// blocks of similar ones, these into blocks of blocks; a frame is then compared with one sample of each block, and
/// with the samples of the most similar blocks. So the time of a frame hardly depends on the number of samples, and
/// some of the best ones may be missed.
class ThinnedImages {
 public:
  static constexpr std::size_t most_compared = 8192;

  /// Copies the cells of all samples; allocates all memory. Takes some microseconds per sample if there are more than
  /// `most_compared`.
  explicit ThinnedImages(const DepthImages& images);
  /// Whether there are no cells to compare.
  [[nodiscard]] bool empty() const noexcept { return depths_.empty(); }
  /// Finds the best samples. observed: padded_cells() depths in steps. Does not allocate.
  void propose(std::span<const float> observed, SelectedSamples& best) noexcept;
  /// The same, and the best ones by the whole frame, of which cells that are not_observed are empty.
  void propose(std::span<const float> observed, BestSamples& best, SelectedSamples& by_whole) noexcept;
  /// Calls visit(sample, mean square) with the samples that the last frame was compared with. Does not allocate.
  template <class Visit>
  void visit_compared(const Visit& visit) const noexcept {
    compare_samples([&](std::uint32_t sample, const LineSums& sums) { visit(sample, lines_.observed_mean(sums)); });
  }

 private:
  static constexpr std::uint32_t block = 16;    // samples, or blocks, in a block
  static constexpr std::uint32_t opened = 256;  // blocks

  void copy_cells(const DepthImages& images);
  void sort_by_similarity(std::span<std::uint32_t> samples);
  void set_frame_of(std::uint32_t place) noexcept;
  [[nodiscard]] std::uint32_t farthest_from(std::uint32_t place, std::span<const std::uint32_t> places) noexcept;
  [[nodiscard]] std::uint32_t middle_of(std::span<const std::uint32_t> places) noexcept;
  void set_frame(std::span<const float> observed) noexcept;
  void choose_compared() noexcept;
  [[nodiscard]] const std::uint16_t* at(std::uint32_t place) const noexcept {
    return &depths_[place * observed_.size()];
  }
  [[nodiscard]] LineSums compare(std::uint32_t place, std::uint32_t next) const noexcept {
    return lines_.compare(code_, at(place), std::numeric_limits<float>::infinity(), at(next));
  }
  /// Root mean square.
  [[nodiscard]] float distance(std::uint32_t place) const noexcept {
    return std::sqrt(lines_.observed_mean(compare(place, place)));
  }
  /// Calls visit(sample, sums).
  template <class Visit>
  void compare_samples(const Visit& visit) const noexcept {
    for (std::size_t i = 0; i < compared_.size(); ++i)
      visit(order_[compared_[i]], compare(compared_[i], compared_[std::min(i + 1, compared_.size() - 1)]));
  }

  const Kernels& code_;
  std::vector<std::uint32_t> cells_;   // the chosen ones
  std::vector<std::uint32_t> order_;   // the sample at each place
  std::vector<std::uint16_t> depths_;  // places x padded chosen cells
  std::vector<float> observed_;        // padded chosen cells
  LineComparison lines_;
  // Of the blocks of samples, of these blocks, and so on, up to `most_compared`: the place of the sample that a frame
  // is compared with
  std::vector<std::vector<std::uint32_t>> representatives_;
  SelectedSamples nearest_;              // blocks
  std::vector<std::uint32_t> compared_;  // blocks, then places
};

}  // namespace lbea
