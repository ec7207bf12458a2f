// Dynamic time warping within a band around the diagonal.
#include "tools/shared/rating/objective_rating.hpp"

#include <algorithm>
#include <cstdint>
#include <limits>

namespace lbea::tool {
namespace {

enum class Step : std::uint8_t { reference, analyzed, both };  // which place is one less in the pair before

class Warping {
 public:
  explicit Warping(const RatedPair& pair)
      : pair_(pair),
        size_(pair.reference.size()),
        reach_((size_ + share - 1) / share - 1),
        costs_(2 * reach_ + 1, none),
        steps_(size_ * costs_.size()) {
    for (std::size_t i = 0; i < size_; ++i) add_row(i);
  }

  /// From the last pair back to the first.
  [[nodiscard]] std::vector<JoinedPlaces> path() const {
    std::vector<JoinedPlaces> path{{size_ - 1, size_ - 1}};
    while (path.back().reference > 0 || path.back().analyzed > 0) {
      JoinedPlaces places = path.back();
      const Step step = steps_[places.reference * costs_.size() + column_of(places)];
      if (step != Step::analyzed) --places.reference;
      if (step != Step::reference) --places.analyzed;
      path.push_back(places);
    }
    std::ranges::reverse(path);
    return path;
  }

 private:
  static constexpr std::size_t share = 10;  // of the signals that is one more than the reach
  static constexpr double none = std::numeric_limits<double>::infinity();

  [[nodiscard]] std::size_t column_of(const JoinedPlaces& places) const noexcept {
    return places.analyzed + reach_ - places.reference;
  }

  // Row i holds the places i - reach to i + reach of the analyzed signal: the same column of the row before is one
  // place less in both.
  void add_row(std::size_t i) {
    double left = none;
    for (std::size_t column = 0; column < costs_.size(); ++column) {
      const bool is_inside = i + column >= reach_ && i + column < size_ + reach_;
      if (!is_inside) {
        costs_[column] = left = none;
        continue;
      }
      const std::size_t j = i + column - reach_;
      const double above = column + 1 < costs_.size() ? costs_[column + 1] : none;
      const auto [before, step] = best_of(above, left, costs_[column]);
      const double difference = pair_.analyzed[j] - pair_.reference[i];
      left = difference * difference + (i == 0 && j == 0 ? 0 : before);
      costs_[column] = left;
      steps_[i * costs_.size() + column] = step;
    }
  }

  struct Best {
    double cost;
    Step step;
  };
  /// The first of equal ones.
  static Best best_of(double above, double left, double diagonal) noexcept {
    Best best{above, Step::reference};
    if (left < best.cost) best = {left, Step::analyzed};
    if (diagonal < best.cost) best = {diagonal, Step::both};
    return best;
  }

  const RatedPair& pair_;
  std::size_t size_, reach_;
  std::vector<double> costs_;  // of the latest row
  std::vector<Step> steps_;
};

}  // namespace

std::vector<JoinedPlaces> warped(const RatedPair& pair) { return Warping(pair).path(); }

}  // namespace lbea::tool
