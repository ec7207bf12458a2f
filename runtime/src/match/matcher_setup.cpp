// The construction of a matcher.
#include "runtime/src/match/matcher.hpp"

namespace lbea {
namespace {
constexpr std::uint32_t most_points = 1u << 28;

void require(bool holds, const std::string& sentence) {
  if (!holds) throw Error(Status::bad_config, "matcher configuration: " + sentence);
}

// R' R = 1 and det R = 1, up to the rounding of a printed calibration file.
bool is_rigid(const RigidTransform& T) noexcept {
  constexpr double tolerance = 1e-3;
  const auto row = [&T](std::size_t i, std::size_t k) { return static_cast<double>(T[4 * i + k]); };
  if (!std::ranges::all_of(T, [](float v) { return std::isfinite(v); })) return false;
  for (std::size_t i = 0; i < 3; ++i)
    for (std::size_t j = i; j < 3; ++j) {
      double dot = 0;
      for (std::size_t k = 0; k < 3; ++k) dot += row(i, k) * row(j, k);
      if (std::abs(dot - (i == j ? 1.0 : 0.0)) > tolerance) return false;
    }
  const double det = row(0, 0) * (row(1, 1) * row(2, 2) - row(1, 2) * row(2, 1)) -
                     row(0, 1) * (row(1, 0) * row(2, 2) - row(1, 2) * row(2, 0)) +
                     row(0, 2) * (row(1, 0) * row(2, 1) - row(1, 1) * row(2, 0));
  return det > 0;
}

}  // namespace

void check(const MatcherConfig& config, const ModelView& model, const SensorViews& views) {
  require(config.max_points >= 1 && config.max_points <= most_points,
          "max_points is " + std::to_string(config.max_points) + "; give 1 to " + std::to_string(most_points));
  require(config.max_matches >= 1, "max_matches is 0; give at least 1");
  require(config.trusted_distance >= 0 && std::isfinite(config.trusted_distance),
          "trusted_distance is " + std::to_string(config.trusted_distance) + "; give a length, or 0 for the default");
  require(config.min_coverage >= 0 && config.min_coverage <= 1,
          "min_coverage is " + std::to_string(config.min_coverage) + "; give a share from 0 to 1");
  require(config.method == Method::lbea || config.method == Method::vtp || config.method == Method::fit,
          "unknown method; give lbea, vtp or fit");
  require(config.method != Method::fit || !views.empty(),
          "the model was baked without a sensor, so there are no depth images to compare with; bake it with one, "
          "render them for the sensor's pose, or match by lbea");
  require(views.empty() || views.data()->depths.size() == model.info.samples * padded_cells(views.data()->camera),
          "the depth images are those of another model");
  require(config.method != Method::vtp ||
              std::ranges::none_of(model.references, [](const ReferenceView& r) { return r.correspondence.empty(); }),
          "the model was baked without the samples' correspondences; bake it with them or match by lbea");
  require(is_rigid(config.T_reference_sensor),
          "T_reference_sensor is not a rigid transform; its left 3x3 part must be a rotation (no scale, no mirror)");
}

MatcherConfig completed(MatcherConfig config, const Model& model) {
  constexpr double trusted_mm = 3;
  if (!(config.trusted_distance > 0))
    config.trusted_distance = static_cast<float>(trusted_mm * units_per_mm(model.length_unit()));
  return config;
}

Matcher::State::State(Model m, const MatcherConfig& c, SensorViews views, std::uint32_t most_compared)
    : model(std::move(m)),
      config(completed(c, model)),
      view(model.view()),
      index(envelope_grid(view.envelope), config.max_points),
      corresponding(view.info.vertices),
      coefficients(view.info.modes),
      public_coefficients(std::size_t{3} * view.info.modes),
      best(std::min(
          config.method == Method::fit ? std::max(config.max_matches, FitSettings{}.proposals) : config.max_matches,
          view.info.samples)),
      matches(std::min(config.max_matches, view.info.samples)),
      channels(model, FitSettings{}.most_combined()),
      has_baked_pose(is_baked(views, view)) {
  if (config.method == Method::fit)
    fitter.emplace(view, std::move(views), config.max_matches, FitSettings{}, most_compared);
  surface.emplace(view, fitter ? fitter->correction().surface_places() : 0);
  if (config.method == Method::vtp)
    for (const ReferenceView& r : view.references) position_searches.emplace_back(view, r);
  else if (compares_positions() && is_worth_a_tree(view.info.samples, best.capacity()))
    for (const ReferenceView& r : view.references) trees.emplace_back(r.coefficients, view.info.modes);
}

bool is_baked(const SensorViews& views, const ModelView& model) noexcept {
  return !views.empty() && model.depth_images != nullptr &&
         views.data()->camera.T_reference_sensor == model.depth_images->camera.T_reference_sensor;
}

Matcher::Matcher(Model model, const MatcherConfig& config, SensorViews views) {
  if (views.empty()) views = SensorViews::baked_into(model, config.T_reference_sensor);
  check(config, model.view(), views);
  state_ = std::make_unique<State>(std::move(model), config, std::move(views));
}
Matcher::~Matcher() = default;
Matcher::Matcher(Matcher&&) noexcept = default;
Matcher& Matcher::operator=(Matcher&&) noexcept = default;
const Model& Matcher::model() const noexcept { return state_->model; }
const MatcherConfig& Matcher::config() const noexcept { return state_->config; }
}  // namespace lbea
