#include "precompute/left_out/left_out_fitter.hpp"

#include "runtime/src/track/inference.hpp"
#include "runtime/src/track/tracker.hpp"

#include <algorithm>
#include <cmath>

namespace lbea::bake {
LeftOutFrame::LeftOutFrame(const LeftOutFrames& frames, std::size_t i, const BestSamples& best, bool hidden)
    : observed(frames.observed(i)), sample(frames.sample(i)), is_hidden(hidden) {
  for (const RankedSample& one : best.ranked()) proposed.push_back(one.sample);
}

LeftOutFitter::LeftOutFitter(const SampleSource& source, const FitCosts& costs, std::size_t most,
                             const ShapeRegression& regression, double pose_variance)
    : source_(source),
      regression_(regression),
      stride_(padded_cells(source.camera)),
      ids_(most),
      depths_(ids_.size() * stride_),
      shapes_(regression.shapes.empty() ? 0 : ids_.size() * ShapeRegression::shape_scores),
      expected_(ids_.size(), 1.0f),
      observed_(stride_),
      image_(stride_),
      points_(source.camera.cells()),
      truth_(source.nodes_of(0)),
      positions_(ids_.size() * truth_.size()),
      landmarks_(source.points_of ? positions_.size() + ids_.size() * 3 * source.surface.between.size() : 0),
      view_(view_of()),
      fitter_(view_,
              SensorViews(
                  std::make_shared<const DepthImages>(DepthImages{.camera = source.camera,
                                                                  .depths = depths_,
                                                                  .expected = expected_,
                                                                  .metric = costs.metric,
                                                                  .prices = costs.prices,
                                                                  .pose_variance = static_cast<float>(pose_variance),
                                                                  .regression = regression_of_proposed()})),
              1) {}

FrameErrors LeftOutFitter::errors(const LeftOutFrame& frame, const PoseBelief* prior, bool corrects) {
  SurfaceFit fit = match(frame, prior);
  truth_ = source_.nodes_of(frame.sample);
  FrameErrors errors{.simulation = source_.samples[frame.sample].simulation, .sample = frame.sample};
  for (const auto& [proposed, weight] : fit.estimate)
    errors.time_step += double{weight} * source_.samples[frame.proposed[proposed.simulation]].time_step;
  if (corrects && source_.points_of) correct(frame, fit);
  const TrackerConfig config = completed({}, source_.length_unit);
  for (const auto& [proposed, weight] : plausible_samples(fit.candidates, config))
    errors.plausible.emplace_back(frame.proposed[proposed.simulation], weight);
  std::vector<WeightedRow> rows;
  for (const auto& [proposed, weight] : fit.estimate) {
    rows.push_back({shape(proposed.simulation), weight});
    errors.weights.emplace_back(frame.proposed[proposed.simulation], weight);
  }
  std::vector<float> estimate;
  weighted_mean(rows, estimate);
  errors.estimate = distance(estimate);
  errors.match = distance(shape(fitter_.matches()[0].sample));
  errors.spread = double{fit.spread};
  const auto completed_image = fitter_.completed();
  if (frame.is_hidden) errors.completed.assign(completed_image.begin(), completed_image.end());
  return errors;
}

ApparentMotion LeftOutFitter::motion(const LeftOutFrame& frame, const PoseMotion& calibration, bool with_points) {
  const PoseBelief prior = PoseBelief::with(calibration);
  const double estimate_error = errors(frame, &prior).estimate;
  ApparentMotion motion{fitter_.pose(), {}, fitter_.pose_fit().variance(), estimate_error};
  if (!with_points || !source_.points_of) return motion;
  SurfaceFit fit;
  correct(frame, fit);
  motion.by_points = fitter_.pose_by_points(calibration);
  return motion;
}

void LeftOutFitter::correct(const LeftOutFrame& frame, SurfaceFit& fit) {
  if (!index_) index_.emplace(source_.grid, static_cast<std::uint32_t>(source_.most_points));
  index_->build(points_of(frame), source_.camera.T_reference_sensor);
  if (index_->size() > 0) fitter_.correct(*index_, fit);
}

/// Without those that something hides.
std::vector<Point> LeftOutFitter::points_of(const LeftOutFrame& frame) const {
  std::vector<Point> points = source_.points_of(frame.sample);
  const DepthCamera& camera = source_.camera;
  if (frame.is_hidden)
    std::erase_if(points, [&](const Point& p) {
      const auto column = static_cast<std::size_t>(camera.center_column + camera.focal * p.x / p.z),
                 row = static_cast<std::size_t>(camera.center_row + camera.focal * p.y / p.z);
      return column >= camera.columns || row >= camera.rows || frame.observed[row * camera.columns + column] < 0;
    });
  return points;
}

SurfaceFit LeftOutFitter::match(const LeftOutFrame& frame, const PoseBelief* prior) {
  std::vector<RankedSample> proposed;
  for (std::uint32_t k = 0; k < frame.proposed.size(); ++k) {
    source_.read_images(frame.proposed[k], std::span(depths_).subspan(k * stride_, stride_));
    std::ranges::copy(source_.nodes_of(frame.proposed[k]), &positions_[k * truth_.size()]);
    if (!landmarks_.empty()) {
      const auto begin = landmarks_.begin() + std::ssize(landmarks_) / std::ssize(ids_) * k;
      std::ranges::copy(shape(k), std::ranges::copy(source_.surface_of(frame.proposed[k]), begin).out);
    }
    if (!shapes_.empty())
      std::ranges::copy(regression_.shape(frame.proposed[k]), &shapes_[k * ShapeRegression::shape_scores]);
    proposed.push_back({k, 0});
  }
  std::ranges::copy(frame.observed, observed_.begin());
  if (prior != nullptr) {
    source_.read_images(frame.sample, image_);
    for (std::size_t c = 0; c < points_.size(); ++c) points_[c] = observed_[c] < 0 ? 0.0f : share_of(image_[c]);
  }
  return fitter_.fit({observed_, frame.is_hidden, frame.predicted, prior, points_}, proposed);
}

ShapeRegression LeftOutFitter::regression_of_proposed() const {
  ShapeRegression regression;
  regression.shapes = shapes_;
  regression.blend = regression_.blend;
  regression.most_difference = regression_.most_difference;
  regression.hidden_blend = regression_.hidden_blend;
  regression.hidden_most_difference = regression_.hidden_most_difference;
  return regression;
}

ModelView LeftOutFitter::view_of() {
  ModelView view;
  std::ranges::copy(truth_, positions_.begin());  // for the component's middle
  for (std::uint32_t k = 0; k < ids_.size(); ++k) ids_[k] = {k, 0};
  view.info.samples = static_cast<std::uint32_t>(ids_.size());
  view.info.nodes = static_cast<std::uint32_t>(truth_.size() / 3);
  view.samples = ids_;
  view.node_positions = positions_;
  view.landmark_positions = landmarks_;
  view.info.vertices = landmarks_.empty() ? 0 : static_cast<std::uint32_t>(source_.surface.between.size());
  view.landmark_edges = source_.surface.edges;
  return view;
}

double LeftOutFitter::distance(std::span<const float> shape) const {
  double sum = 0;
  for (std::size_t i = 0; i < shape.size(); i += 3)
    sum += std::hypot(double{shape[i]} - double{truth_[i]}, double{shape[i + 1]} - double{truth_[i + 1]},
                      double{shape[i + 2]} - double{truth_[i + 2]});
  return 3 * sum / static_cast<double>(shape.size());
}

}  // namespace lbea::bake
