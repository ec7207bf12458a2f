// The depth images' sections of a model.
#include "runtime/src/depth/depth_images.hpp"
#include "runtime/src/model/section_reader.hpp"

#include <cstring>
#include <initializer_list>

namespace lbea {
namespace {

/// The sections of one rig's images.
class ViewSections {
 public:
  ViewSections(const SectionReader& sections, std::uint32_t rig) : sections_(sections), rig_(rig) {}
  [[nodiscard]] const format::SectionEntry* find(format::SectionId id) const noexcept {
    return sections_.find(id, rig_);
  }
  template <typename T>
  [[nodiscard]] std::span<const T> required(format::SectionId id, SectionReader::Shape shape) const {
    return sections_.required<T>(id, shape, rig_);
  }
  [[nodiscard]] const SectionContent& content(format::SectionId id) const noexcept {
    return sections_.content(id, rig_);
  }
  [[noreturn]] void fail(format::SectionId id, const std::string& what) const { sections_.fail(id, rig_, what); }
  /// Of sections that exist only beside `other`, which the rig does not have.
  void expect_none(std::initializer_list<format::SectionId> ids, format::SectionId other) const {
    for (const format::SectionId id : ids)
      if (find(id) != nullptr) fail(id, "there is no section " + std::to_string(static_cast<std::uint32_t>(other)));
  }

 private:
  const SectionReader& sections_;
  std::uint32_t rig_;
};

constexpr double most_cost_steps = 1e9;  // sums of squares over all cells do not overflow a float

DepthCamera camera_from(const format::DepthCameraWords& words, std::span<const std::uint32_t> size) noexcept {
  DepthCamera camera;
  std::ranges::transform(words.T_reference_sensor, camera.T_reference_sensor.begin(),
                         [](double v) { return static_cast<float>(v); });
  camera.focal = static_cast<float>(words.focal);
  camera.center_column = static_cast<float>(words.center_column);
  camera.center_row = static_cast<float>(words.center_row);
  camera.depth_origin = static_cast<float>(words.depth_origin);
  camera.depth_step = static_cast<float>(words.depth_step);
  camera.columns = size[0];
  camera.rows = size[1];
  return camera;
}

format::DepthCameraWords camera_words(const ViewSections& sections, const DepthMetric& usual) {
  using format::SectionId;
  const bool has_metric = sections.find(SectionId::view_camera)->shape[0] != format::depth_camera_words_1_0;
  const auto numbers = sections.required<double>(
      SectionId::view_camera, {has_metric ? format::depth_camera_words : format::depth_camera_words_1_0, 1, 1});
  if (!std::ranges::all_of(numbers, format::is_measured<double>))
    sections.fail(SectionId::view_camera, "a value is not finite or too large");
  format::DepthCameraWords words{};
  words.cap = double{usual.cap};
  words.one_sided = double{usual.one_sided};
  std::memcpy(&words, numbers.data(), numbers.size_bytes());
  const std::array positive{words.focal, words.depth_step, words.misfit_limit, words.test_misfit_limit,
                            words.cap,   words.one_sided};
  if (!std::ranges::all_of(positive, [](double v) { return v >= 1 / format::largest_measure; }) ||
      !(words.error_per_spread >= 0))
    sections.fail(SectionId::view_camera, "a value is not positive");
  if (!(std::max(words.cap, words.one_sided) <= most_cost_steps * words.depth_step))
    sections.fail(SectionId::view_camera, "a cost is too many depth steps");
  return words;
}

void read_regression(const ViewSections& sections, std::uint64_t samples, DepthImages& images) {
  using format::SectionId;
  if (sections.find(SectionId::regression_numbers) == nullptr)
    return sections.expect_none({SectionId::regression_basis, SectionId::regression_images,
                                 SectionId::regression_weights, SectionId::regression_shapes},
                                SectionId::regression_numbers);
  ShapeRegression& regression = images.regression;
  const auto numbers = sections.required<double>(SectionId::regression_numbers, {5, 1, 1});
  constexpr std::uint64_t k = ShapeRegression::image_scores, shape_scores = ShapeRegression::shape_scores;
  const std::uint64_t trained = ShapeRegression::trained_with(samples);
  const auto read = [&](SectionId id, std::uint64_t rows, std::uint64_t values) {
    const auto section = sections.required<float>(id, {rows, values, 1});
    if (!sections.content(id).is_measured) sections.fail(id, "a value is not finite or too large");
    return section;
  };
  regression.basis = read(SectionId::regression_basis, 2 + k, ShapeRegression::features(images.camera));
  regression.images = read(SectionId::regression_images, trained, k);
  regression.weights = read(SectionId::regression_weights, shape_scores, format::padded(trained));
  regression.shapes = read(SectionId::regression_shapes, samples, shape_scores);
  const auto within = [](double v, double low, double high) { return v >= low && v <= high; };
  constexpr double least = 1 / format::largest_measure, most = format::largest_measure;
  if (!within(numbers[2], 0, 1) ||
      (numbers[2] > 0 &&
       !(within(numbers[0], least, most) && within(numbers[1], least, most) && within(numbers[3], 0, most))) ||
      !within(numbers[4], 0, most))
    sections.fail(SectionId::regression_numbers, "a value is out of range");
  regression.one_sided = static_cast<float>(numbers[0]);
  regression.length_scale = static_cast<float>(numbers[1]);
  regression.blend = static_cast<float>(numbers[2]);
  regression.most_difference = static_cast<float>(numbers[3]);
  images.error_bound.per_spread = numbers[4];
}

struct Range {
  double low, high;
};
constexpr Range positive_range{1 / format::largest_measure, format::largest_measure},
    measure_range{0, format::largest_measure}, share_range{0, 1};

/// Of an optional section, row by row; empty without it. columns: the ranges of their values.
std::span<const double> optional_numbers(const ViewSections& sections, format::SectionId id, SectionReader::Shape shape,
                                         std::span<const Range> columns) {
  if (sections.find(id) == nullptr) return {};
  const auto numbers = sections.required<double>(id, shape);
  for (std::size_t i = 0; i < numbers.size(); ++i)
    if (const auto [low, high] = columns[i % columns.size()]; !(numbers[i] >= low && numbers[i] <= high))
      sections.fail(id, "a value is out of range");
  return numbers;
}

void read_hidden_numbers(const ViewSections& sections, DepthImages& images) {
  const double most_price = most_cost_steps * double{images.camera.depth_step};
  const auto numbers = optional_numbers(sections, format::SectionId::hidden_numbers, {3, 1, 1},
                                        std::array{Range{positive_range.low, most_price}, share_range, measure_range});
  if (numbers.empty()) return;
  images.metric.hidden = static_cast<float>(numbers[0]);
  images.regression.hidden_blend = static_cast<float>(numbers[1]);
  images.regression.hidden_most_difference = static_cast<float>(numbers[2]);
}

void read_prices(const ViewSections& sections, DepthImages& images) {
  // Far smaller ones leave the least squares singular in single precision
  const auto numbers = optional_numbers(sections, format::SectionId::estimate_prices, {all_prices.size(), 1, 1},
                                        std::array{Range{1e-5, 1e4}});
  for (std::size_t i = 0; i < numbers.size(); ++i) images.prices.*all_prices[i] = static_cast<float>(numbers[i]);
}

void read_error_growths(const ViewSections& sections, DepthImages& images) {
  const auto numbers =
      optional_numbers(sections, format::SectionId::error_growths, {2, 2, 1}, std::array{Range{-1, 1}, positive_range});
  if (numbers.empty()) return;
  images.error_bound.growth = numbers[0], images.error_bound.typical = numbers[1];
  images.hidden_error_bound.growth = numbers[2], images.hidden_error_bound.typical = numbers[3];
}

void read_bounds(const ViewSections& sections, std::uint64_t fields, DepthImages& images) {
  const auto numbers = optional_numbers(sections, format::SectionId::spread_bounds, {1 + fields, 2, 1},
                                        std::array{share_range, measure_range});
  for (std::size_t i = 0; i < numbers.size(); i += 2) images.bounds.push_back({numbers[i], numbers[i + 1]});
}

/// Positive definite, as far as readers depend on it: entries are no larger than the diagonal ones permit.
bool is_spread(const PoseMatrix& matrix) noexcept {
  for (std::size_t i = 0; i < 36; ++i) {
    const double rows = matrix[7 * (i / 6)], columns = matrix[7 * (i % 6)];
    if (!format::is_measured(matrix[i]) || !(rows >= 1 / format::largest_measure) ||
        !(matrix[i] * matrix[i] <= rows * columns * (1 + 1e-9)))
      return false;
  }
  return true;
}

void read_expected_residuals(const ViewSections& sections, std::uint64_t samples, DepthImages& images) {
  constexpr auto id = format::SectionId::expected_residuals;
  if (sections.find(id) == nullptr) return;
  images.expected = sections.required<float>(id, {samples, 1, 1});
  if (!std::ranges::all_of(images.expected, [](float v) { return v >= 0 && format::is_measured(v); }))
    sections.fail(id, "a value is negative or not finite");
}

/// A pair; both 0 without the section.
std::array<double, 2> pose_numbers(const ViewSections& sections, format::SectionId id) {
  const auto numbers = optional_numbers(sections, id, {2, 1, 1}, std::array{measure_range});
  if (numbers.empty()) return {};
  return {numbers[0], numbers[1]};
}

std::optional<PoseSpreads> pose_spreads(const ViewSections& sections, format::SectionId id) {
  if (sections.find(id) == nullptr) return {};
  const auto matrices = sections.required<PoseMatrix>(id, {PoseSpreads::times, 6, 6});
  if (!std::ranges::all_of(matrices, is_spread)) sections.fail(id, "a matrix is not positive definite");
  PoseSpreads spreads;
  std::ranges::copy(matrices, spreads.at_times.begin());
  return spreads;
}

void read_pose_and_time(const ViewSections& sections, DepthImages& images) {
  using format::SectionId;
  const auto [variance, drift_evidence] = pose_numbers(sections, SectionId::pose_numbers);
  images.pose_variance = static_cast<float>(variance);
  images.pose_errors = {pose_spreads(sections, SectionId::pose_spreads).value_or(PoseSpreads()), drift_evidence};
  if ((sections.find(SectionId::pose_spreads_by_points) == nullptr) !=
      (sections.find(SectionId::pose_numbers_by_points) == nullptr))
    sections.fail(SectionId::pose_spreads_by_points, "there is only one of it and pose_numbers_by_points");
  const auto [is_known, evidence_with_points] = pose_numbers(sections, SectionId::pose_numbers_by_points);
  if (const auto spreads = pose_spreads(sections, SectionId::pose_spreads_by_points); spreads && is_known > 0)
    images.pose_errors_by_points = {*spreads, evidence_with_points};
  if (const auto numbers = optional_numbers(sections, SectionId::time_numbers, {1, 1, 1}, std::array{measure_range});
      !numbers.empty())
    images.time_variation = static_cast<float>(numbers[0]);
}

}  // namespace

std::shared_ptr<const DepthImages> read_depth_images(const SectionReader& reader, const format::Info& info,
                                                     std::string_view length_unit, std::uint32_t rig) {
  using format::SectionId;
  const ViewSections sections(reader, rig);
  if (sections.find(SectionId::view_camera) == nullptr) {
    sections.expect_none({SectionId::view_size, SectionId::view_depths, SectionId::regression_shapes},
                         SectionId::view_camera);
    return nullptr;
  }
  const DepthMetric usual = DepthMetric{}.in(length_unit);
  const format::DepthCameraWords words = camera_words(sections, usual);
  const auto size = sections.required<std::uint32_t>(SectionId::view_size, {2, 1, 1});
  constexpr std::uint32_t most_along_an_axis = 1u << 14;
  if (!std::ranges::all_of(size, [](std::uint32_t cells) { return cells > 0 && cells <= most_along_an_axis; }))
    sections.fail(SectionId::view_size, "an impossible number of cells");

  auto images = std::make_shared<DepthImages>();
  images->camera = camera_from(words, size);
  images->metric = {static_cast<float>(words.cap), static_cast<float>(words.one_sided), usual.mesh_noise, usual.hidden};
  images->error_bound.per_spread = images->hidden_error_bound.per_spread = words.error_per_spread;
  images->misfit_limit = static_cast<float>(words.misfit_limit);
  images->test_misfit_limit = static_cast<float>(words.test_misfit_limit);
  images->depths =
      sections.required<std::uint16_t>(SectionId::view_depths, {info.samples, padded_cells(images->camera), 1});
  read_expected_residuals(sections, info.samples, *images);
  read_regression(sections, info.samples, *images);
  read_hidden_numbers(sections, *images);
  read_prices(sections, *images);
  read_error_growths(sections, *images);
  read_bounds(sections, info.fields, *images);
  read_pose_and_time(sections, *images);
  return images;
}

}  // namespace lbea
