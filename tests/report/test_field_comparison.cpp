// Comparison of displacement fields by CWA 16799: coefficients, their uncertainty, and the verdict.
#include "runtime/src/model/model_view.hpp"
#include "tests/report/studied_plates.hpp"
#include "tests/support/refusals.hpp"
#include "tools/shared/matching/shapes.hpp"

#include <doctest/doctest.h>

#include <numeric>

using namespace lbea;
using namespace lbea::tool;
using namespace lbea::test;

namespace {

constexpr double impact_s = 0.002;  // since the test's first frame

/// Frames whose estimate is a simulation's state number 4, 8, 12 ... at its own time after the impact.
FrameStudy frames_like(const Model& model, std::uint32_t simulation, float error_90) {
  FrameStudy study;
  for (std::uint32_t step = 4; step < 41; step += 4) {
    const std::vector<float> shape = positions_of(model, {{{simulation, step}, 1.0f}});
    const CloudComparison without_points({}, shape, elements_of(model), 0);
    study.frames.push_back(
        {impact_s + 0.0005 * step, {}, {}, shape, shape, 0, 0, without_points, without_points, false});
    study.frames.back().result.fit.error_90 = error_90;
  }
  return study;
}

ChannelStudy against(std::uint32_t simulation) { return {simulation, impact_s, {}}; }

/// Vertices x 3.
std::vector<double> difference(const Model& model, const StudiedFrame& frame, const Shape& shape) {
  const std::vector<float> other = positions_of(model, shape);
  std::vector<double> field;
  for (const std::uint32_t node : model.vertex_nodes(0))
    for (std::size_t k = 0; k < 3; ++k)
      field.push_back(double{frame.estimate[3 * node + k]} - double{other[3 * node + k]});
  return field;
}

double mean_square(const Model& model, std::span<const double> field) {
  const auto mass = model.view().references[0].mass;
  double squares = 0;
  for (std::size_t i = 0; i < field.size(); ++i) squares += mass[i / 3] * field[i] * field[i];
  return squares / std::accumulate(mass.begin(), mass.end(), 0.0);
}

double sum_of_squares(std::span<const double> values) {
  return std::inner_product(values.begin(), values.end(), values.begin(), 0.0);
}

}  // namespace

TEST_CASE("the surface's shapes are orthonormal, so squares of coefficients and residual add up to the field's") {
  const Model plates = model();
  const SurfaceShapes shapes(plates, 0);
  const StudiedFrame frame = std::move(frames_like(plates, 2, 1).frames.back());
  const std::vector<double> field = difference(plates, frame, {{{0, 10}, 1.0f}}),
                            coefficients = shapes.coefficients(field);
  REQUIRE(coefficients.size() == 3 * plates.modes());
  const double residual = shapes.average_residual(field, coefficients);
  CHECK(residual > 0);
  CHECK(sum_of_squares(coefficients) + residual * residual ==
        doctest::Approx(mean_square(plates, field)).epsilon(1e-4));  // eigenvectors are stored as floats

  // The first shape of a connected surface is constant: with a mean square of 1, its coefficient is the mean.
  const std::vector<double> shifted(field.size(), 2.5);
  const std::vector<double> of_shift = shapes.coefficients(shifted);
  for (std::size_t k = 0; k < 3; ++k) CHECK(std::abs(of_shift[k]) == doctest::Approx(2.5).epsilon(1e-5));
  CHECK(sum_of_squares(std::span(of_shift).subspan(3)) < 1e-6);
}

TEST_CASE("a simulation is acceptable for its own displacements, between its states too") {
  const Model plates = model();
  FrameStudy study = frames_like(plates, 2, 0.5f);
  StudiedFrame& between = study.frames[2];  // 6 ms after the impact
  between.time_s += 0.0002;
  between.estimate = positions_of(plates, {{{2, 12}, 0.6f}, {{2, 13}, 0.4f}});
  const FieldComparison comparison = compare_fields(plates, study, against(2), true);
  REQUIRE(comparison.frames.size() == study.frames.size());
  for (const ComparedFields& frame : comparison.frames) {
    CHECK(std::abs(frame.differences[frame.largest()]) < 1e-3);  // positions of 1,000 mm as floats
    CHECK(frame.agreeing() == frame.differences.size());
    CHECK(frame.uncertainty() == doctest::Approx(std::hypot(0.25, frame.average_residual)).epsilon(1e-6));
  }
}

TEST_CASE("another simulation is acceptable where the test is less certain than they differ") {
  const Model plates = model();
  for (const float error_90 : {0.01f, 1e4f}) {
    const FrameStudy study = frames_like(plates, 2, error_90);
    const FieldComparison comparison = compare_fields(plates, study, against(0), true);
    REQUIRE(comparison.frames.size() == study.frames.size());
    const ComparedFields& last = comparison.frames.back();
    const std::vector<double> field = difference(plates, study.frames.back(), {{{0, 40}, 1.0f}});
    const std::vector<double> expected = SurfaceShapes(plates, 0).coefficients(field);
    std::size_t agreeing = 0;
    for (std::size_t i = 0; i < expected.size(); ++i) {
      CHECK(last.differences[i] == doctest::Approx(expected[i]).epsilon(1e-6));
      agreeing += std::abs(expected[i]) <= 2 * last.uncertainty() ? 1u : 0u;
      CHECK(std::abs(expected[i]) <= std::abs(last.differences[last.largest()]) * (1 + 1e-6));
    }
    CHECK(last.agreeing() == agreeing);
    CHECK((last.agreement() == FieldAgreement::not_acceptable) == (error_90 < 1));
  }
}

// Regression: the less certain a test was, the more simulations it accepted.
TEST_CASE("a test that cannot tell the simulations apart, or that the shapes do not represent, decides nothing") {
  const Model plates = model();
  const ComparedFields certain = compare_fields(plates, frames_like(plates, 2, 1.0f), against(2), true).frames.back();
  // Of the plates' ends, by its definition.
  const SurfaceShapes shapes(plates, 0);
  double largest = 0;
  for (std::size_t i = 0; i < certain.differences.size(); ++i) {
    std::vector<double> values;
    for (std::uint32_t run = 0; run < plates.simulations(); ++run)
      values.push_back(
          shapes.coefficients(difference(plates, frames_like(plates, run, 1).frames.back(), {{{0, 0}, 1.0f}}))[i]);
    const double mean = std::accumulate(values.begin(), values.end(), 0.0) / static_cast<double>(values.size());
    double squares = 0;
    for (const double value : values) squares += (value - mean) * (value - mean);
    largest = std::max(largest, std::sqrt(squares / static_cast<double>(values.size() - 1)));
  }
  // As baked: by the nearest points of the surface, which are at most as far as the nodes.
  CHECK(certain.spread <= largest * (1 + 1e-4));
  CHECK(certain.spread > largest / 2);
  ComparedFields fields = certain;
  fields.average_residual = 0.5 * fields.test_uncertainty;
  CHECK(fields.agreement() ==
        (fields.uncertainty() < fields.spread ? FieldAgreement::acceptable : FieldAgreement::undecided));
  fields.test_uncertainty = 2 * fields.spread;
  CHECK(fields.agreement() == FieldAgreement::undecided);
  fields.test_uncertainty = 0.1 * fields.spread;
  fields.average_residual = 0.05 * fields.spread;
  CHECK(fields.agreement() == FieldAgreement::acceptable);
  fields.average_residual = 0.2 * fields.spread;
  CHECK(fields.agreement() == FieldAgreement::undecided);
  fields.differences.front() = fields.spread;
  CHECK(fields.agreement() == FieldAgreement::not_acceptable);
}

TEST_CASE("frames without a simulated state or a bound of the error are not compared") {
  const Model plates = model();
  FrameStudy study = frames_like(plates, 2, 1);
  study.frames.front().time_s = impact_s;  // undeformed
  study.frames.back().time_s += 0.001;     // after the simulation
  study.frames[1].result.fit.error_90 = FrameRow::unknown;
  CHECK(compare_fields(plates, study, against(2), true).frames.size() == study.frames.size() - 3);
  CHECK(compare_fields(plates, study, against(2), false).why_not == "no simulation explains the test");
  CHECK(compare_fields(plates, study, {std::nullopt, impact_s, {}}, true).why_not == "no simulation explains the test");
  CHECK(compare_fields(plates, study, {2, std::nullopt, {}}, true).why_not == "the time of the impact is not known");
  CHECK(contains(compare_fields(plates, frames_like(plates, 2, FrameRow::unknown), against(2), true).why_not,
                 "no frame after the impact has a bound"));
}

TEST_CASE("the report says whether the simulation is acceptable, or why it was not compared") {
  TestReport report = report_of(plates(), frames_of(model(), 2));
  CHECK(contains(fields_section(report), "Not compared with a simulation"));
  report.frames = frames_like(report.model, 2, 1.0f);
  report.channels.simulation = 2;
  report.fields = compare_fields(report.model, report.frames, against(2), true);
  for (ComparedFields& frame : report.fields.frames) {
    frame.average_residual = 0;
    frame.spread = 10;
  }
  CHECK_MESSAGE(contains(fields_section(report),
                         "By CWA 16799, simulation plate_2 is acceptable</strong> (10 frames, 0 undecided, 0 not)"),
                fields_section(report));
  for (ComparedFields& frame : report.fields.frames) frame.spread = 0.1;
  CHECK(contains(fields_section(report), "It is undecided whether simulation plate_2 is acceptable"));
  report.frames = frames_like(report.model, 2, 0.01f);
  report.fields = compare_fields(report.model, report.frames, against(0), true);
  report.channels.simulation = 0;
  const std::string section = fields_section(report);
  CHECK_MESSAGE(contains(section, "simulation plate_0 is not acceptable"), section);
  CHECK(contains(section, " of " + std::to_string(3 * report.model.modes()) + "</td>"));
}
