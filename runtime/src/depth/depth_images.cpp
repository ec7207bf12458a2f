#include "runtime/src/depth/depth_images.hpp"

#include "runtime/src/model/model_view.hpp"
#include "runtime/src/model/section_reader.hpp"

#include <cstring>

namespace lbea {
namespace {

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

format::DepthCameraWords camera_words(const SectionReader& sections, const DepthMetric& usual) {
  using format::SectionId;
  const bool has_metric = sections.find(SectionId::view_camera)->shape[0] != format::depth_camera_words_1_0;
  const auto numbers = sections.required<double>(
      SectionId::view_camera, {has_metric ? format::depth_camera_words : format::depth_camera_words_1_0, 1, 1});
  if (!std::ranges::all_of(numbers, format::is_measured<double>))
    sections.fail(SectionId::view_camera, 0, "a value is not finite or too large");
  format::DepthCameraWords words{};
  words.cap = double{usual.cap};
  words.one_sided = double{usual.one_sided};
  std::memcpy(&words, numbers.data(), numbers.size_bytes());
  const std::array positive{words.focal, words.depth_step, words.misfit_limit, words.test_misfit_limit,
                            words.cap,   words.one_sided};
  if (!std::ranges::all_of(positive, [](double v) { return v >= 1 / format::largest_measure; }) ||
      !(words.error_per_spread >= 0))
    sections.fail(SectionId::view_camera, 0, "a value is not positive");
  if (!(std::max(words.cap, words.one_sided) <= most_cost_steps * words.depth_step))
    sections.fail(SectionId::view_camera, 0, "a cost is too many depth steps");
  return words;
}

void read_regression(const SectionReader& sections, std::uint64_t samples, DepthImages& images) {
  using format::SectionId;
  if (sections.find(SectionId::regression_numbers) == nullptr) return;
  ShapeRegression& regression = images.regression;
  const auto numbers = sections.required<double>(SectionId::regression_numbers, {5, 1, 1});
  constexpr std::uint64_t k = ShapeRegression::image_scores, shape_scores = ShapeRegression::shape_scores;
  const std::uint64_t trained = ShapeRegression::trained_with(samples);
  const auto read = [&](SectionId id, std::uint64_t rows, std::uint64_t values) {
    const auto section = sections.required<float>(id, {rows, values, 1});
    if (!sections.content(id).is_measured) sections.fail(id, 0, "a value is not finite or too large");
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
    sections.fail(SectionId::regression_numbers, 0, "a value is out of range");
  regression.one_sided = static_cast<float>(numbers[0]);
  regression.length_scale = static_cast<float>(numbers[1]);
  regression.blend = static_cast<float>(numbers[2]);
  regression.most_difference = static_cast<float>(numbers[3]);
  images.error_per_spread = static_cast<float>(numbers[4]);
}

void read_hidden_numbers(const SectionReader& sections, DepthImages& images) {
  constexpr auto id = format::SectionId::hidden_numbers;
  if (sections.find(id) == nullptr) return;
  const auto numbers = sections.required<double>(id, {3, 1, 1});
  const double most_price = most_cost_steps * double{images.camera.depth_step};
  if (!(numbers[0] >= 1 / format::largest_measure && numbers[0] <= most_price) ||
      !(numbers[1] >= 0 && numbers[1] <= 1) || !(numbers[2] >= 0 && numbers[2] <= format::largest_measure))
    sections.fail(id, 0, "a value is out of range");
  images.metric.hidden = static_cast<float>(numbers[0]);
  images.regression.hidden_blend = static_cast<float>(numbers[1]);
  images.regression.hidden_most_difference = static_cast<float>(numbers[2]);
}

void read_bounds(const SectionReader& sections, std::uint64_t fields, DepthImages& images) {
  constexpr auto id = format::SectionId::spread_bounds;
  if (sections.find(id) == nullptr) return;
  for (const auto& [share, per_spread] : sections.required<std::array<double, 2>>(id, {1 + fields, 2, 1})) {
    if (!(share >= 0 && share <= 1) || !(per_spread >= 0 && per_spread <= format::largest_measure))
      sections.fail(id, 0, "a value is out of range");
    images.bounds.push_back({share, per_spread});
  }
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

RigidTransform inverse(const RigidTransform& T) noexcept {
  RigidTransform inverted;
  for (std::size_t i = 0; i < 3; ++i) {
    double shift = 0;
    for (std::size_t k = 0; k < 3; ++k) {
      inverted[4 * i + k] = T[4 * k + i];
      shift -= double{T[4 * k + i]} * double{T[4 * k + 3]};
    }
    inverted[4 * i + 3] = static_cast<float>(shift);
  }
  return inverted;
}

}  // namespace

[[gnu::cold]]  // compiled for size
std::shared_ptr<const DepthImages>
read_depth_images(const SectionReader& sections, const format::Info& info, std::string_view length_unit) {
  using format::SectionId;
  if (sections.find(SectionId::view_camera) == nullptr) return nullptr;
  const auto require = [&](bool holds, SectionId id, const char* what) {
    if (!holds) sections.fail(id, 0, what);
  };
  const DepthMetric usual = DepthMetric{}.in(length_unit);
  const format::DepthCameraWords words = camera_words(sections, usual);
  const auto size = sections.required<std::uint32_t>(SectionId::view_size, {2, 1, 1});
  constexpr std::uint32_t most_along_an_axis = 1u << 14;
  require(std::ranges::all_of(size, [](std::uint32_t cells) { return cells > 0 && cells <= most_along_an_axis; }),
          SectionId::view_size, "an impossible number of cells");

  auto images = std::make_shared<DepthImages>();
  images->camera = camera_from(words, size);
  images->metric = {static_cast<float>(words.cap), static_cast<float>(words.one_sided), usual.mesh_noise, usual.hidden};
  images->error_per_spread = images->hidden_error_per_spread = static_cast<float>(words.error_per_spread);
  images->misfit_limit = static_cast<float>(words.misfit_limit);
  images->test_misfit_limit = static_cast<float>(words.test_misfit_limit);
  images->depths =
      sections.required<std::uint16_t>(SectionId::view_depths, {info.samples, padded_cells(images->camera), 1});
  if (sections.find(SectionId::expected_residuals) != nullptr) {
    images->expected = sections.required<float>(SectionId::expected_residuals, {info.samples, 1, 1});
    require(std::ranges::all_of(images->expected, [](float v) { return v >= 0 && format::is_measured(v); }),
            SectionId::expected_residuals, "a value is negative or not finite");
  }
  read_regression(sections, info.samples, *images);
  read_hidden_numbers(sections, *images);
  read_bounds(sections, info.fields, *images);
  if (sections.find(SectionId::pose_numbers) != nullptr) {
    const auto numbers = sections.required<double>(SectionId::pose_numbers, {2, 1, 1});
    require(std::ranges::all_of(numbers, [](double v) { return v >= 0 && format::is_measured(v); }),
            SectionId::pose_numbers, "a value is negative or not finite");
    images->pose_variance = static_cast<float>(numbers[0]);
    images->drift_evidence = static_cast<float>(numbers[1]);
  }
  if (sections.find(SectionId::pose_spreads) != nullptr) {
    const auto spreads = sections.required<PoseMatrix>(SectionId::pose_spreads, {PoseSpreads::times, 6, 6});
    require(std::ranges::all_of(spreads, is_spread), SectionId::pose_spreads, "a matrix is not positive definite");
    std::ranges::copy(spreads, images->pose_spreads.at_times.begin());
  }
  if (sections.find(SectionId::time_numbers) != nullptr) {
    const auto numbers = sections.required<double>(SectionId::time_numbers, {1, 1, 1});
    require(numbers[0] >= 0 && format::is_measured(numbers[0]), SectionId::time_numbers, "negative or not finite");
    images->time_variation = static_cast<float>(numbers[0]);
  }
  return images;
}

SensorViews SensorViews::baked_into(const Model& model) {
  const auto& baked = model.view().depth_images;
  if (baked == nullptr) return {};
  // The copy of the model keeps the mapping that holds the images.
  auto kept = std::make_shared<std::pair<Model, DepthImages>>(model, *baked);
  return SensorViews(std::shared_ptr<const DepthImages>(kept, &kept->second));
}

std::uint32_t SensorViews::columns() const noexcept { return data_ ? data_->camera.columns : 0; }
std::uint32_t SensorViews::rows() const noexcept { return data_ ? data_->camera.rows : 0; }
const RigidTransform& SensorViews::T_reference_sensor() const noexcept {
  return data_ ? data_->camera.T_reference_sensor : identity_transform;
}

std::vector<float> SensorViews::depth_image(std::uint32_t sample) const {
  std::vector<float> image;
  if (!data_) return image;
  const DepthCamera& camera = data_->camera;
  for (const std::uint16_t depth : data_->of_sample(sample).first(camera.cells()))
    image.push_back(depth == empty_cell ? std::numeric_limits<float>::quiet_NaN()
                                        : camera.depth_origin + camera.depth_step * static_cast<float>(depth));
  return image;
}

float SensorViews::expected_residual(std::uint32_t sample) const noexcept {
  return data_ && sample < data_->expected.size() ? data_->expected[sample] : 0;
}
float SensorViews::misfit_limit() const noexcept { return data_ ? data_->misfit_limit : 0; }
float SensorViews::test_misfit_limit() const noexcept { return data_ ? data_->test_misfit_limit : 0; }

CellPrices prices_of(const DepthMetric& metric, const DepthCamera& camera) noexcept {
  return {metric.cap / camera.depth_step, metric.one_sided / camera.depth_step};
}

float mean_square(const Kernels& code, std::span<const float> observed, const std::uint16_t* sample,
                  const CellPrices& prices) noexcept {
  const CellSums sums = code.compare_depths(observed.data(), sample, observed.size(), prices);
  return sums.squares / std::max(sums.filled, 1.0f);
}

namespace {

/// Calls visit(cell) for one and the cells around it.
template <class Visit>
void visit_around(const DepthCamera& camera, std::size_t cell, const Visit& visit) noexcept {
  const std::size_t row = cell / camera.columns, column = cell % camera.columns;
  const auto begin = [](std::size_t i) { return i - std::min<std::size_t>(i, 1); };
  for (std::size_t r = begin(row); r < std::min<std::size_t>(row + 2, camera.rows); ++r)
    for (std::size_t c = begin(column); c < std::min<std::size_t>(column + 2, camera.columns); ++c)
      visit(r * camera.columns + c);
}

/// Of what either image shows in a cell, the least difference to the 3 x 3 cells of the other one: the greater of the
/// two. Infinite if the other image shows nothing there.
float tolerant_difference(const DepthCamera& camera, std::span<const float> observed,
                          std::span<const std::uint16_t> image, std::size_t cell) noexcept {
  constexpr float infinity = std::numeric_limits<float>::infinity();
  const float seen = observed[cell], expected = image[cell];
  const bool is_seen = seen >= 0, is_expected = image[cell] != empty_cell;
  float of_seen = is_seen ? infinity : 0, of_expected = is_expected ? infinity : 0;
  visit_around(camera, cell, [&](std::size_t other) {
    if (is_seen && image[other] != empty_cell)
      of_seen = std::min(of_seen, std::abs(static_cast<float>(image[other]) - seen));
    if (is_expected && observed[other] >= 0) of_expected = std::min(of_expected, std::abs(observed[other] - expected));
  });
  return std::max(of_seen, of_expected);
}

}  // namespace

float tolerant_residuals(const Kernels& code, const DepthCamera& camera, const CellPrices& prices,
                         std::span<const float> observed, std::span<const std::uint16_t> image,
                         std::span<float> residuals) noexcept {
  code.subtract_depths(observed.data(), image.data(), observed.size(), prices, residuals.data());
  const float origin = camera.depth_origin / camera.depth_step;
  const auto is_edge = [&](std::size_t cell) {
    const float width = (origin + std::max(observed[cell], static_cast<float>(image[cell]))) / camera.focal;
    return std::abs(residuals[cell]) > width;
  };
  constexpr std::size_t line = 32;
  for (std::size_t begin = 0; begin < camera.cells(); begin += line) {
    const std::size_t end = std::min(begin + line, camera.cells());
    int edges = 0;  // most lines have none, and their cells are tested several at once
    for (std::size_t cell = begin; cell < end; ++cell) edges += is_edge(cell) ? 1 : 0;
    for (std::size_t cell = begin; edges > 0 && cell < end; ++cell)
      if (is_edge(cell))
        residuals[cell] = std::copysign(
            std::min(tolerant_difference(camera, observed, image, cell), std::abs(residuals[cell])), residuals[cell]);
  }
  float squares = 0;
  code.project(residuals.data(), 1, residuals.size(), residuals.data(), &squares);
  return squares / std::max(code.compare_depths(observed.data(), image.data(), observed.size(), prices).filled, 1.0f);
}

float share_after_interpolation(const Kernels& code, std::span<const float> a, std::span<const float> b) noexcept {
  const auto product = [&](std::span<const float> x, std::span<const float> y) {
    float sum = 0;
    code.project(x.data(), 1, x.size(), y.data(), &sum);
    return sum;
  };
  const float squared = product(a, a), decrease = squared - product(a, b);
  const float apart = 2 * decrease - squared + product(b, b);  // |a - b|^2
  if (!(squared > 0) || !(apart > 0)) return 1;
  const float t = std::clamp(decrease / apart, 0.0f, 1.0f);
  return std::max(squared - t * (2 * decrease - t * apart), 0.0f) / squared;
}

[[gnu::cold]]  // compiled for size
LineComparison::LineComparison(std::size_t cells, const CellPrices& prices)
    : begins_((cells + FilledLines::cells - 1) / FilledLines::cells),
      observed_(begins_.size() * FilledLines::cells),
      filled_after_(begins_.size()) {
  const float largest = std::max(prices.cap, prices.one_sided);
  while (prices_.shift < 15 && largest > std::ldexp(float{ShortPrices::most}, static_cast<int>(prices_.shift)))
    ++prices_.shift;
  const float scale = std::ldexp(1.0f, static_cast<int>(prices_.shift));
  const auto in_units = [scale](float price) {
    return static_cast<std::uint16_t>(std::lround(std::min(price / scale, float{ShortPrices::most})));
  };
  prices_.cap = in_units(prices.cap);
  prices_.one_sided = in_units(prices.one_sided);
  unit_ = square(scale);
  one_sided_ = square(prices.one_sided);
}

void LineComparison::set_frame(std::span<const float> observed) noexcept {
  constexpr std::size_t cells = FilledLines::cells;
  constexpr float most = std::numeric_limits<std::uint16_t>::max();
  constexpr std::size_t part = FilledLines::part;
  std::size_t& count = count_ = 0;
  for (std::size_t begin = 0; begin < observed.size(); begin += cells) {
    std::uint16_t* const line = &observed_[count * cells];
    int filled = 0;
    for (std::size_t c = 0; c < cells; ++c) {
      const float depth = observed[begin + c];
      line[c] = static_cast<std::uint16_t>(static_cast<int>(depth >= 0 ? std::clamp(depth + 0.5f, 1.0f, most) : 0.0f));
      filled += depth >= 0 ? 1 : 0;
    }
    if (filled == 0) continue;
    filled_after_[count] = static_cast<float>(filled);
    begins_[count++] = static_cast<std::uint32_t>(begin);
  }
  float all = 0;
  for (std::size_t line = 0; line < count; ++line) all += filled_after_[line];
  for (std::size_t begin = 0; begin < count; begin += part) {
    for (std::size_t line = begin; line < std::min(begin + part, count); ++line) all -= filled_after_[line];
    filled_after_[begin / part] = all;
  }
}

LineSums LineComparison::compare(const Kernels& code, const std::uint16_t* sample, float bound,
                                 const std::uint16_t* next) const noexcept {
  constexpr float rounding = 2;  // bound of the error of any cell's cost, in units, and so of the root mean square
  const float most =
      bound < one_sided_ ? square(std::sqrt(bound / unit_) + rounding) : std::numeric_limits<float>::infinity();
  const FilledLines lines{begins_.data(), count_, observed_.data(), filled_after_.data()};
  LineSums sums = code.compare_lines(lines, sample, prices_, most, next);
  sums.squares *= unit_;
  return sums;
}

Surroundings::Surroundings(const DepthCamera& camera)
    : columns_(camera.columns),
      rows_(camera.rows),
      filled_(columns_ + 2 * reach),
      near_(columns_),
      along_row_(camera.cells()) {}

// Bytes alias members, so the loops' pointers are local.
void Surroundings::limit(std::span<float> observed) noexcept {
  const std::size_t columns = columns_;
  std::uint8_t *const filled = filled_.data(), *const near = near_.data();
  for (std::size_t row = 0; row < rows_; ++row) {
    const float* const depths = &observed[row * columns];
    std::uint8_t* const along = &along_row_[row * columns];
    for (std::size_t c = 0; c < columns; ++c) filled[reach + c] = depths[c] >= 0 ? 1 : 0;
    std::fill_n(along, columns, std::uint8_t{0});
    for (std::size_t shift = 0; shift <= 2 * reach; ++shift)
      for (std::size_t c = 0; c < columns; ++c) along[c] = static_cast<std::uint8_t>(along[c] | filled[c + shift]);
  }
  for (std::size_t row = 0; row < rows_; ++row) {
    std::fill_n(near, columns, std::uint8_t{0});
    for (std::size_t other = row - std::min(row, reach); other < std::min(row + reach + 1, rows_); ++other) {
      const std::uint8_t* const along = &along_row_[other * columns];
      for (std::size_t c = 0; c < columns; ++c) near[c] = static_cast<std::uint8_t>(near[c] | along[c]);
    }
    float* const depths = &observed[row * columns];
    for (std::size_t c = 0; c < columns; ++c) depths[c] = near[c] != 0 ? depths[c] : not_observed;
  }
}

FrameDepthImage::FrameDepthImage(const DepthCamera& camera)
    : raster_{camera.focal,          camera.center_column, camera.center_row, camera.depth_origin,
              1 / camera.depth_step, camera.columns,       camera.rows},
      T_sensor_reference_(inverse(camera.T_reference_sensor)),
      tallies_(camera.cells() + 1),
      points_(camera.cells()),
      cells_(padded_cells(camera), nothing_seen) {}

void FrameDepthImage::build(const CloudIndex& index) noexcept {
  std::ranges::fill(tallies_, CellTally{});
  index.add_depths(T_sensor_reference_, raster_, tallies_.data());
  const std::size_t cells = points_.size();
  float points = 0, filled = 0;
  const auto total = [this](std::size_t cell, float CellTally::Sum::*of) {
    const auto& four = tallies_[cell].of;
    return (four[0].*of + four[1].*of) + (four[2].*of + four[3].*of);
  };
  for (std::size_t c = 0; c < cells; ++c) {
    points += points_[c] = total(c, &CellTally::Sum::points);
    filled += points_[c] > 0 ? 1.0f : 0.0f;
  }
  constexpr float share_of_mean = 0.25f;
  const float fewest = share_of_mean * points / std::max(filled, 1.0f);
  for (std::size_t c = 0; c < cells; ++c)
    cells_[c] = points_[c] > 0 && points_[c] >= fewest ? total(c, &CellTally::Sum::depth) / points_[c] : nothing_seen;
}

ThinnedImages::ThinnedImages(const DepthImages& images)
    : code_(kernels()), prices_(prices_of(images.metric, images.camera)) {
  const DepthCamera& camera = images.camera;
  for (std::uint32_t row = every / 2; row < camera.rows; row += every)
    for (std::uint32_t column = every / 2; column < camera.columns; column += every)
      cells_.push_back(row * camera.columns + column);
  const std::size_t stride = padded_cells(cells_.size()), samples = images.depths.size() / padded_cells(camera);
  if (cells_.empty() || samples * stride * sizeof(std::uint16_t) > most_bytes) return;
  observed_.assign(stride, not_observed);
  depths_.assign(samples * stride, empty_cell);
  for (std::size_t s = 0; s < samples; ++s)
    std::ranges::transform(cells_, &depths_[s * stride], [image = images.of_sample(s)](auto c) { return image[c]; });
}

void ThinnedImages::set_frame(std::span<const float> observed) noexcept {
  std::ranges::transform(cells_, observed_.begin(), [&](std::uint32_t c) { return observed[c]; });
}

float ThinnedImages::distance(std::size_t sample) const noexcept {
  return mean_square(code_, observed_, &depths_[sample * observed_.size()], prices_);
}

void ThinnedImages::propose(std::span<const float> observed, BestSamples& best) noexcept {
  set_frame(observed);
  best.clear();
  for (std::size_t s = 0; s < depths_.size() / observed_.size(); ++s)
    best.offer(static_cast<std::uint32_t>(s), distance(s));
}

void ThinnedImages::put_first(std::span<const float> observed, std::size_t count,
                              std::span<RankedSample> samples) noexcept {
  set_frame(observed);
  for (std::size_t i = 0; i < samples.size(); ++i) {
    const std::uint16_t* const next = &depths_[samples[std::min(i + 2, samples.size() - 1)].sample * observed_.size()];
    for (std::size_t c = 0; c < observed_.size(); c += 32) __builtin_prefetch(next + c);
    samples[i].distance = distance(samples[i].sample);
  }
  std::nth_element(samples.begin(), samples.begin() + static_cast<std::ptrdiff_t>(count - 1), samples.end(),
                   [](const RankedSample& a, const RankedSample& b) { return a.distance < b.distance; });
}

}  // namespace lbea
