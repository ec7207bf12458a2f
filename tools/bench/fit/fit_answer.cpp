#include "tools/bench/fit/fit_answer.hpp"

#include "runtime/src/depth/combination.hpp"
#include "tools/shared/text/formatted.hpp"

#include <algorithm>

namespace lbea::tool::bench {
namespace {

std::array<double, 12> inverse(const RigidTransform& T) {
  std::array<double, 12> inverted{};
  for (std::size_t i = 0; i < 3; ++i)
    for (std::size_t k = 0; k < 3; ++k) {
      inverted[4 * i + k] = T[4 * k + i];
      inverted[4 * i + 3] -= double{T[4 * k + i]} * double{T[4 * k + 3]};
    }
  return inverted;
}

/// Over the cells that either image fills: mean square of the capped differences, in squared depth steps.
double mean_square(std::span<const float> observed, std::span<const std::uint16_t> image, const CellPrices& prices) {
  double squares = 0, filled = 0;
  for (std::size_t c = 0; c < observed.size(); ++c) {
    const bool in_frame = observed[c] >= 0, in_sample = image[c] != empty_cell;
    if (observed[c] == not_observed || (!in_frame && !in_sample)) continue;
    const double difference = std::min(std::abs(double{observed[c]} - image[c]), double{prices.cap});
    squares += square<double>(in_frame && in_sample ? static_cast<float>(difference) : prices.one_sided);
    ++filled;
  }
  return squares / std::max(filled, 1.0);
}

}  // namespace

FitCheck::FitCheck(const MatchTask& task, const DepthImages& images, std::span<const Point> points)
    : images_(images),
      proposals_(task.proposals),
      candidates_(task.candidates),
      T_camera_reference_(inverse(images.camera.T_reference_sensor)),
      cells_(images.camera.cells()) {
  const ReferenceCloud cloud(points, task.T_reference_sensor, task.model.envelope);
  position_error_ = cloud.position_error;
  for (std::size_t i = 0; i < points.size(); ++i)
    if (cloud.membership[i] != Membership::outside) add(cloud.positions[i], cloud.membership[i] == Membership::inside);
}

FitCheck::Cell* FitCheck::cell_at(double column, double row) {
  const DepthCamera& camera = images_.camera;
  if (!(column >= 0 && column < camera.columns && row >= 0 && row < camera.rows)) return nullptr;
  return &cells_[static_cast<std::size_t>(row) * camera.columns + static_cast<std::size_t>(column)];
}

// A cell's coordinate is focal * x / depth + center. Its error: that of the position, and some roundings of each term.
void FitCheck::add(const Position& p, bool is_certain) {
  constexpr double roundings = 16;
  const DepthCamera& camera = images_.camera;
  std::array<double, 3> in_camera{};
  double largest = 0;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const double* row = &T_camera_reference_[4 * axis];
    in_camera[axis] = row[0] * p[0] + row[1] * p[1] + row[2] * p[2] + row[3];
    largest = std::max({largest, std::abs(row[3]), std::abs(p[axis])});
  }
  const double depth = in_camera[2], error = 3 * position_error_ + roundings * float_rounding * largest;
  if (depth <= error) return;
  depth_error_ = std::max(depth_error_, error);
  const double scale = camera.focal / depth;
  const std::array at{scale * in_camera[0] + camera.center_column, scale * in_camera[1] + camera.center_row};
  const auto error_of = [&](double coordinate) {
    return scale * error + std::abs(coordinate) * error / depth +
           roundings * float_rounding * (std::abs(coordinate) + camera.columns + camera.rows);
  };
  const double across = error_of(at[0]), down = error_of(at[1]);
  const std::array corners{cell_at(at[0] - across, at[1] - down), cell_at(at[0] + across, at[1] - down),
                           cell_at(at[0] - across, at[1] + down), cell_at(at[0] + across, at[1] + down)};
  if (!is_certain || std::ranges::count(corners, corners[0]) != 4) {
    ++uncertain_points_;
    for (Cell* cell : corners)
      if (cell != nullptr) cell->is_certain = false;
  }
  Cell* cell = cell_at(at[0], at[1]);
  if (cell == nullptr) return;
  cell->depth += (depth - double{camera.depth_origin}) / double{camera.depth_step};
  ++cell->points;
}

Mismatch FitCheck::wrong_cell(std::span<const float> depth_image) const {
  constexpr double share_of_mean = 0.25;  // a cell with fewer points counts as empty
  double points = 0, filled = 0;
  std::size_t compared = 0;
  for (const Cell& cell : cells_) {
    points += cell.points;
    filled += cell.points > 0;
  }
  const double fewest = share_of_mean * points / std::max(filled, 1.0),
               uncertain =
                   share_of_mean * uncertain_points_ / std::max(filled, 1.0) * (1 + points / std::max(filled, 1.0));
  for (std::size_t c = 0; c < cells_.size(); ++c) {
    const Cell& cell = cells_[c];
    if (!cell.is_certain || (cell.points > 0 && std::abs(cell.points - fewest) <= uncertain)) continue;
    const bool is_filled = cell.points > 0 && cell.points >= fewest;
    const double here = depth_image[c], mean = cell.depth / cell.points;
    compared += is_filled;
    if (is_filled != (here >= 0))
      return formatted("cell %zu of the depth image: %s", c, is_filled ? "empty" : "filled");
    const double error =
        depth_error_ / double{images_.camera.depth_step} + (cell.points + 16) * float_rounding * std::abs(mean);
    if (is_filled && !(std::abs(here - mean) <= error))
      return formatted("cell %zu of the depth image: %.9g depth steps, should be %.9g", c, here, mean);
  }
  if (2 * static_cast<double>(compared) < filled)
    return formatted("the depth image: only %zu of %.0f filled cells do not depend on rounding", compared, filled);
  return {};
}

// By the depth image of the answer.
Mismatch FitCheck::wrong_proposal(const FitAnswer& answer) const {
  const std::vector<std::uint32_t> cells = thinned_cells(images_);
  const auto thinned = [&](auto image) {
    std::vector<std::ranges::range_value_t<decltype(image)>> some;
    for (const std::uint32_t cell : cells) some.push_back(image[cell]);
    return some;
  };
  const std::vector<float> observed = thinned(std::span(answer.depth_image));
  const CellPrices prices = prices_of(images_.metric, images_.camera);
  std::vector<double> distances;
  for (std::size_t s = 0; s < images_.depths.size() / padded_cells(images_.camera); ++s)
    distances.push_back(std::sqrt(mean_square(observed, thinned(images_.of_sample(s)), prices)));
  std::vector<RankedSample> proposed = answer.proposed;
  for (RankedSample& one : proposed) one.distance = std::sqrt(one.distance);
  std::ranges::sort(proposed, {}, &RankedSample::distance);
  // They are compared in whole units: each cost differs by less than two of these.
  const double unit = std::max(1.0, 2.0 * double{std::max(prices.cap, prices.one_sided)} / ShortPrices::most);
  const double missed = distances.size() > ThinnedImages::most_compared ? 0.1 : 0;
  return wrong_ranking(proposed, distances, proposals_,
                       {2 * unit, static_cast<double>(cells.size()) * float_rounding, missed});
}

// By the depth image of the answer. What all candidates fill and the frame does not counts as hidden: the candidates
// are then ranked without it.
Mismatch FitCheck::wrong_candidate(const Answer& answer) const {
  constexpr double infinity = std::numeric_limits<double>::infinity();
  const CellPrices prices = prices_of(images_.metric, images_.camera);
  std::vector<float> observed = answer.fit->depth_image;
  std::vector<RankedSample> samples;
  const auto compare = [&](std::uint32_t sample) {
    return mean_square(observed, images_.of_sample(sample).first(observed.size()), prices);
  };
  for (const RankedSample& one : answer.fit->proposed.empty() ? answer.ranked : answer.fit->proposed)
    samples.push_back({one.sample, static_cast<float>(compare(one.sample))});
  std::ranges::sort(samples, {}, [](const RankedSample& one) { return std::pair(one.distance, one.sample); });
  samples.resize(std::min(candidates_, samples.size()));
  for (std::size_t c = 0; c < observed.size(); ++c)
    if (observed[c] == nothing_seen &&
        std::ranges::all_of(samples, [&](auto& one) { return images_.of_sample(one.sample)[c] != empty_cell; }))
      observed[c] = not_observed;
  std::vector<double> distances(images_.depths.size() / padded_cells(images_.camera), infinity);
  for (const RankedSample& one : samples)
    distances[one.sample] = double{images_.camera.depth_step} * std::sqrt(compare(one.sample));
  const auto terms = static_cast<double>(observed.size());
  return wrong_ranking(answer.fit->candidates, distances, candidates_, {0, terms * float_rounding});
}

Mismatch FitCheck::disagreement(const Answer& answer) const {
  if (answer.fit->depth_image.size() != cells_.size())
    return formatted("%zu cells in the depth image, should be %zu", answer.fit->depth_image.size(), cells_.size());
  if (Mismatch wrong = wrong_cell(answer.fit->depth_image)) return wrong;
  if (answer.fit->is_hidden) return {};
  if (!answer.fit->proposed.empty())
    if (Mismatch wrong = wrong_proposal(*answer.fit)) return wrong;
  return wrong_candidate(answer);
}

FrameCheck::FrameCheck(const MatchTask& task, std::span<const Point> points) : answer_(task, points) {
  if (task.method == Method::fit) fit_.emplace(task, *task.model.depth_images, points);
}

Mismatch FrameCheck::disagreement(const Answer& answer) {
  const bool compares_positions = !answer.fit || answer.fit->proposed.empty();
  if (compares_positions)
    if (Mismatch wrong = answer_.disagreement(answer)) return wrong;
  return fit_ && answer.fit ? fit_->disagreement(answer) : Mismatch{};
}

MatchTask task_of(const Model& model, const MatcherConfig& config) {
  const FitSettings settings;
  return {
      model.view(),       config.method,      config.T_reference_sensor, std::min(config.max_matches, model.samples()),
      settings.proposals, settings.candidates};
}

}  // namespace lbea::tool::bench
