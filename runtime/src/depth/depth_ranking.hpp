// The ranking of samples by the comparison of their depth images with that of a frame, and what something may hide of
// it.
#pragma once

#include "runtime/src/depth/combination.hpp"
#include "runtime/src/depth/image_comparison.hpp"
#include "runtime/src/depth/shape_history.hpp"

#include <bit>

namespace lbea {

/// What something may hide of a frame: where a sample's image is filled over at least five rows and columns and the
/// frame's is empty. Narrower differences are differences of the silhouette.
class HiddenParts {
 public:
  /// Allocates all memory.
  explicit HiddenParts(const DepthCamera& camera);
  /// observed: padded_cells() values of the frame that samples are compared with. Does not allocate.
  void set_frame(std::span<const float> observed) noexcept;
  /// The same; only cells that are not_observed may be hidden.
  void set_frame_with_known_parts(std::span<const float> observed) noexcept;
  /// image: of a sample. Returns the number of cells that may be hidden. Does not allocate.
  std::size_t find(std::span<const std::uint16_t> image) noexcept;
  /// Number of cells that the frame and the last image both fill.
  [[nodiscard]] std::size_t filled_by_both() const noexcept { return filled_by_both_; }
  /// Calls visit(cell) for the last ones found.
  template <class Visit>
  void visit(const Visit& visit) const noexcept {
    for (std::size_t row = 0; row < rows_; ++row)
      for (std::size_t word = 0; word < words_; ++word)
        for (std::uint64_t bits = parts_[at(row) + word]; bits != 0; bits &= bits - 1)
          visit(row * columns_ + word * bits_of_word + static_cast<std::size_t>(std::countr_zero(bits)));
  }

 private:
  static constexpr std::size_t width = 2 * Surroundings::reach + 1, margin = width - 1;  // cells
  static constexpr std::size_t bits_of_word = 64;
  /// The first word of a row.
  [[nodiscard]] std::size_t at(std::size_t row) const noexcept { return (row + margin) * words_; }
  /// Sets the bits of a row where `is_set` holds.
  template <class IsSet>
  void set_row(std::vector<std::uint64_t>& into, std::size_t row, const IsSet& is_set) noexcept;

  std::size_t columns_, rows_, words_;  // words: of a row and the margin after it
  bool are_known_ = false;
  std::size_t filled_by_both_ = 0;
  std::vector<std::uint8_t> in_row_;  // per cell of a row 1 or 0
  // A bit per cell. Margins of zeros before and after all rows and after all columns
  std::vector<std::uint64_t> empty_, allowed_, parts_;
};

/// Where something hid the component in the earlier frames of a test. It usually stays where it is, so that parts which
/// were in view remain in view: where these cells are empty, the component is elsewhere.
class HiddenCells {
 public:
  /// Allocates all memory.
  explicit HiddenCells(const DepthCamera& camera);
  /// Of the depth image, hidden or not.
  [[nodiscard]] std::size_t cells() const noexcept { return is_hidden_.size(); }
  void reset() noexcept;
  /// Whether there are any, and the frame shows few of them: what hides them has not moved. Does not allocate.
  [[nodiscard]] bool is_confirmed_by(std::span<const float> frame) const noexcept;
  /// frame: padded_cells() values; what it shows is no longer hidden. Does not allocate.
  void remove_shown(std::span<const float> frame) noexcept;
  void add(const HiddenParts& parts) noexcept;
  /// Empty cells of a frame within `Surroundings::reach` of the hidden ones become not_observed. Does not allocate.
  void exclude_from(std::span<float> frame) const noexcept;

 private:
  std::size_t columns_, rows_, count_ = 0;
  std::vector<std::uint8_t> is_hidden_;  // per cell
};

/// Squared residuals between a frame and a sample.
struct SquareSums {
  float squares = 0, hidden = 0;  // squared depth steps: of what the frame shows; price of what something may hide
  float cells = 1;                // that the mean is over
  // Of the cells that the frame shows, if something hides a part of it: squares of the depths; a cell that the sample
  // does not fill counts as a hidden one
  float depths = 0, shown = 1;

  SquareSums& operator+=(const SquareSums& other) noexcept {
    squares += other.squares, hidden += other.hidden, cells += other.cells;
    depths += other.depths, shown += other.shown;
    return *this;
  }
  [[nodiscard]] float mean() const noexcept { return (squares + hidden) / cells; }
  [[nodiscard]] float mean_of_depths() const noexcept { return depths / shown; }
};

/// Where something hides a part, the costs of the outline and of the hidden part vary more from state to state than
/// those of the depths, and hide which sample fits the depths best. Hence depths have a cost of their own: of n
/// differences of unknown scale, the negative logarithm of the likelihood is n/2 ln(mean square) up to a constant.
/// Differences of shapes are alike in neighboring cells, so that n is small; those by noise are independent. n
/// increases as the least mean square approaches the noise. Replaces the samples' mean squares, at least one, by these
/// costs, of which the least is 0. noise: squared, of the metric, in the same unit, > 0.
void set_depth_costs(std::span<float> mean_squares, float noise) noexcept;

/// Ranks samples by how well their depth images explain that of a frame.
class DepthRanking {
 public:
  // By what a frame shows: of these samples hidden parts are found, which takes longer than a comparison
  static constexpr std::uint32_t most_promising = 96;

  /// Keeps the best `capacity` of at most `most_proposed` samples. sharpness: of the Plausibility. Allocates all
  /// memory.
  DepthRanking(const DepthCamera& camera, std::uint32_t capacity, const DepthMetric& metric,
               std::uint32_t most_proposed = FitSettings{}.proposals, float sharpness = FitSettings{}.sharpness);

  /// observed: padded_cells() depths in steps; depths: the images of all samples; proposed: the samples to rank.
  /// A cell that all of the best samples fill and the frame does not is regarded as occluded, not as a hole in the
  /// component: it becomes `not_observed` and is ignored from then on. The best ones are then ordered by mean square
  /// and cost. Returns the least mean square before that. filled_cells: per sample, their number in its image; without
  /// them all images are compared completely. Fastest when the best ones come first. Does not allocate.
  float rank(std::span<float> observed, std::span<const std::uint16_t> depths, std::span<const RankedSample> proposed,
             const ExpectationCosts* costs = nullptr, std::span<const std::uint32_t> filled_cells = {}) noexcept;
  /// The same where something hides a part, of a frame limited to its surroundings: each sample is compared with the
  /// whole frame as if what it fills and the frame does not, in HiddenParts, cost little and were not among the cells
  /// of the mean; see set_depth_costs(). Returns by how much the best sample's distance exceeds the mean square of what
  /// the frame shows.
  /// knows_parts: only cells that are not_observed may be hidden; the frame is not limited to its surroundings.
  float rank_hidden(std::span<const float> observed, std::span<const std::uint16_t> depths,
                    std::span<const RankedSample> proposed, const ExpectationCosts* costs = nullptr,
                    bool knows_parts = false) noexcept;
  /// The costs of compare() and hidden parts from now on. rank() needs those of the constructor. Does not allocate.
  void use(const DepthMetric& metric) noexcept;
  /// Prepares compare() of single samples with a frame: as rank(), or where something hides a part as rank_hidden().
  void set_frame(std::span<const float> observed, bool is_hidden, bool knows_parts) noexcept;
  [[nodiscard]] SquareSums compare(std::span<const std::uint16_t> image) noexcept;
  /// The same of what the frame shows and its surroundings, but for what the sample or all of the best ones continue.
  /// To be followed by set_frame().
  [[nodiscard]] SquareSums compare_shown(std::span<const std::uint16_t> image) noexcept;
  /// Sets the residuals of a sample in its hidden parts to their price or to 0, after rank_hidden(). Returns the number
  /// of these cells.
  float price_hidden(std::span<const float> observed, std::span<const std::uint16_t> image, std::span<float> residuals,
                     bool has_price = true) noexcept;
  /// What something may hide of a frame that shows any of the best samples.
  [[nodiscard]] const HiddenParts& hidden_parts(std::span<const float> frame,
                                                std::span<const std::uint16_t> depths) noexcept;

  /// Best first. distance: mean square over the cells that either image fills, in squared depth steps, and the price of
  /// the sample's costs, also those of set_depth_costs().
  [[nodiscard]] std::span<const RankedSample> ranked() const noexcept { return best_.ranked(); }
  /// Price of a cost, in squared depth steps.
  [[nodiscard]] float price_per_cost() const noexcept { return price_per_cost_; }
  [[nodiscard]] std::size_t capacity() const noexcept { return best_.capacity(); }
  [[nodiscard]] const CellPrices& prices() const noexcept { return prices_; }
  /// Residual of a cell in a hidden part, in depth steps.
  [[nodiscard]] float hidden_price() const noexcept { return hidden_price_; }

 private:
  /// Some more than the best, by depths in whole steps. The exact comparison then decides.
  void find_nearly_best(std::span<const float> observed, std::span<const std::uint16_t> depths,
                        std::span<const RankedSample> proposed, std::span<const std::uint32_t> filled_cells) noexcept;
  /// Sets compared_.
  void compare(std::span<const float> observed, std::span<const std::uint16_t> depths,
               std::span<const RankedSample> proposed) noexcept;
  /// Of those in compared_. depth_costs: of each, or none.
  void choose(BestSamples& best, const ExpectationCosts* costs, std::span<const float> depth_costs = {}) noexcept;

  const Kernels& code_;
  DepthCamera camera_;
  CellPrices prices_;  // in depth steps
  float hidden_price_;
  float noise_, sharpness_;             // squared depth steps; of the Plausibility
  std::vector<RankedSample> compared_;  // distance: mean square
  std::size_t compared_count_ = 0;
  BestSamples best_;
  float price_per_cost_ = 0;
  std::vector<RankedSample> chosen_;
  std::vector<std::uint16_t> common_;  // per cell: 0 where the image of any of the best is empty
  std::vector<std::uint16_t> any_;     // per cell: 0 where the images of all of them are
  LineComparison lines_;
  static constexpr std::uint32_t spare = 8;
  BestSamples nearly_best_;
  BestSamples promising_;            // by what the frame shows
  std::vector<float> depth_costs_;   // of promising_
  std::span<const float> observed_;  // the frame
  std::vector<float> whole_;         // the frame, empty cells as evidence wherever they are
  float shown_cells_ = 1;            // of the frame
  bool is_hidden_ = false;           // something hides a part of it
  HiddenParts parts_;
};

}  // namespace lbea
