#include "tools/report/content/comparison/field_comparison.hpp"

#include "runtime/src/model/model_view.hpp"
#include "runtime/src/model/run_samples.hpp"

#include <algorithm>
#include <cmath>
#include <functional>
#include <numeric>

namespace lbea::tool {
namespace {

/// At a time since the first state, between two states; empty before it and after the last one.
Shape shape_at(const Model& model, const RunSamples& run, double since_first_s) {
  const auto times = model.view().sample_times;
  const double time_s = times[run.first] + since_first_s;
  if (since_first_s < 0 || time_s > times[run.first + run.count - 1]) return {};
  const auto [before, share] = run.place_of(times, time_s);
  const auto state = static_cast<std::uint32_t>(before);
  const auto later = static_cast<float>(share);
  if (later == 0) return {{model.sample(state), 1.0f}};
  return {{model.sample(state), 1 - later}, {model.sample(state + 1), later}};
}

/// Displacements from the reference mesh, vertices x 3. positions: nodes x 3.
std::vector<double> displacements(const Model& model, std::uint32_t reference, std::span<const float> positions) {
  const auto nodes = model.vertex_nodes(reference);
  const auto undeformed = model.vertex_positions(reference);
  std::vector<double> field(undeformed.size());
  for (std::size_t i = 0; i < nodes.size(); ++i)
    for (std::size_t k = 0; k < 3; ++k)
      field[3 * i + k] = double{positions[3 * nodes[i] + k]} - double{undeformed[3 * i + k]};
  return field;
}

/// Of the baked coefficients of all simulations that last until then.
double spread_at(const Model& model, std::span<const RunSamples> runs, const SurfaceShapes& shapes,
                 double since_impact_s) {
  std::vector<double> sums(3 * model.modes()), squares(sums.size());
  double count = 0;
  for (const RunSamples& run : runs) {
    const Shape shape = shape_at(model, run, since_impact_s);
    if (shape.empty()) continue;
    const std::vector<double> own = shapes.baked_coefficients(model, shape);
    for (std::size_t i = 0; i < own.size(); ++i) {
      sums[i] += own[i];
      squares[i] += own[i] * own[i];
    }
    ++count;
  }
  double largest = 0;
  for (std::size_t i = 0; i < sums.size() && count > 1; ++i)
    largest = std::max(largest, (squares[i] - sums[i] * sums[i] / count) / (count - 1));
  return std::sqrt(largest);
}

ComparedFields compared(const Model& model, const SurfaceShapes& shapes, const StudiedFrame& frame,
                        std::span<const float> simulated) {
  const std::vector<double> test = displacements(model, shapes.reference(), frame.estimate);
  const std::vector<double> of_test = shapes.coefficients(test),
                            simulation = shapes.coefficients(displacements(model, shapes.reference(), simulated));
  ComparedFields fields;
  fields.time_s = frame.time_s;
  fields.differences.resize(of_test.size());
  std::ranges::transform(of_test, simulation, fields.differences.begin(), std::minus<>{});
  fields.test_uncertainty = double{frame.result.fit.error_90} / 2;
  fields.average_residual = shapes.average_residual(test, of_test);
  return fields;
}

}  // namespace

SurfaceShapes::SurfaceShapes(const Model& model, std::uint32_t reference)
    : reference_(reference), modes_(model.modes()) {
  const ReferenceView& view = model.view().references[reference];
  const std::size_t vertices = view.mass.size();
  const double area = std::accumulate(view.mass.begin(), view.mass.end(), 0.0);
  root_share_ = 1 / std::sqrt(area);
  for (const double mass : view.mass) shares_.push_back(mass / area);
  values_.reserve(modes_ * vertices);
  for (std::size_t mode = 0; mode < modes_; ++mode)
    for (std::size_t i = 0; i < vertices; ++i)  // a row of the projection is the eigenvector times the masses
      values_.push_back(std::sqrt(area) * double{view.projection[mode * format::padded(vertices) + i]} / view.mass[i]);
}

std::vector<double> SurfaceShapes::coefficients(std::span<const double> field) const {
  std::vector<double> sums(3 * modes_);
  for (std::size_t mode = 0; mode < modes_; ++mode)
    for (std::size_t i = 0; i < shares_.size(); ++i)
      for (std::size_t k = 0; k < 3; ++k)
        sums[3 * mode + k] += shares_[i] * values_[mode * shares_.size() + i] * field[3 * i + k];
  return sums;
}

double SurfaceShapes::average_residual(std::span<const double> field, std::span<const double> coefficients) const {
  std::vector<double> residual(field.begin(), field.end());
  for (std::size_t mode = 0; mode < modes_; ++mode)
    for (std::size_t i = 0; i < shares_.size(); ++i)
      for (std::size_t k = 0; k < 3; ++k)
        residual[3 * i + k] -= coefficients[3 * mode + k] * values_[mode * shares_.size() + i];
  double squares = 0;
  for (std::size_t i = 0; i < residual.size(); ++i) squares += shares_[i / 3] * residual[i] * residual[i];
  return std::sqrt(squares);
}

std::vector<double> SurfaceShapes::baked_coefficients(const Model& model, const Shape& shape) const {
  const ReferenceView& view = model.view().references[reference_];
  const std::size_t stride = format::padded(modes_);
  std::vector<double> sums(3 * modes_);
  for (const WeightedSample& share : shape)
    for (std::size_t k = 0; k < 3; ++k)
      for (std::size_t mode = 0; mode < modes_; ++mode)
        sums[3 * mode + k] += double{share.weight} * root_share_ *
                              double{view.coefficients[(3 * model.sample_index(share.sample) + k) * stride + mode]};
  return sums;
}

double ComparedFields::uncertainty() const noexcept { return std::hypot(test_uncertainty, average_residual); }

std::size_t ComparedFields::agreeing() const noexcept {
  return static_cast<std::size_t>(std::ranges::count_if(
      differences, [this](double difference) { return std::abs(difference) <= 2 * uncertainty(); }));
}

FieldAgreement ComparedFields::agreement() const noexcept {
  if (agreeing() < differences.size()) return FieldAgreement::not_acceptable;
  const bool is_decided = uncertainty() < spread && average_residual <= test_uncertainty;
  return is_decided ? FieldAgreement::acceptable : FieldAgreement::undecided;
}

std::size_t ComparedFields::largest() const noexcept {
  const auto largest =
      std::ranges::max_element(differences, {}, [](double difference) { return std::abs(difference); });
  return static_cast<std::size_t>(largest - differences.begin());
}

std::size_t FieldComparison::count(FieldAgreement agreement) const noexcept {
  return static_cast<std::size_t>(std::ranges::count(frames, agreement, &ComparedFields::agreement));
}

FieldAgreement FieldComparison::agreement() const noexcept {
  if (count(FieldAgreement::not_acceptable) > 0) return FieldAgreement::not_acceptable;
  return count(FieldAgreement::acceptable) > 0 ? FieldAgreement::acceptable : FieldAgreement::undecided;
}

FieldComparison compare_fields(const Model& model, const FrameStudy& frames, const ChannelStudy& channels,
                               bool is_explained) {
  FieldComparison comparison;
  if (!is_explained || !channels.simulation) return {{}, "no simulation explains the test"};
  if (!channels.impact_s) return {{}, "the time of the impact is not known"};
  const std::vector<RunSamples> runs =
      samples_of_runs(model.samples(), [&](std::size_t s) { return model.view().samples[s][0]; });
  const auto compared_run = std::ranges::find(
      runs, *channels.simulation, [&](const RunSamples& run) { return model.view().samples[run.first][0]; });
  if (compared_run == runs.end()) return {{}, "the model has no state of the simulation"};
  std::optional<SurfaceShapes> shapes;
  for (const StudiedFrame& frame : frames.frames) {
    const double since_impact_s = channels.since_impact(frame.time_s);
    if (!(since_impact_s > 0)) continue;  // undeformed shapes may differ
    const Shape simulated = shape_at(model, *compared_run, since_impact_s);
    if (simulated.empty() || !std::isfinite(frame.result.fit.error_90)) continue;
    const std::uint32_t reference = std::min(frame.result.reference, model.references() - 1);
    if (!shapes || shapes->reference() != reference) shapes.emplace(model, reference);
    comparison.frames.push_back(compared(model, *shapes, frame, positions_of(model, simulated)));
    comparison.frames.back().spread = spread_at(model, runs, *shapes, since_impact_s);
  }
  if (comparison.frames.empty()) comparison.why_not = "no frame after the impact has a bound of the estimate's error";
  return comparison;
}

}  // namespace lbea::tool
