#include "precompute/model_file/model_sections.hpp"

#include <bit>
#include <cstring>

namespace lbea::bake {
namespace {

using format::ElementType;
using format::SectionId;

std::uint32_t count32(std::size_t count, const std::string& what) {
  if (count >= std::numeric_limits<std::uint32_t>::max())
    throw Error(Status::bad_config, std::to_string(count) + " " + what + " are more than a model can hold; use fewer");
  return static_cast<std::uint32_t>(count);
}

template <typename Strings>
std::string joined(const Strings& strings) {
  std::string text;
  for (const std::string& string : strings) text.append(string).push_back('\0');
  return text;
}

void add_ensemble(SmallSections& sections, const format::Info& info, const BakePlan& plan) {
  const Ensemble& ensemble = plan.ensemble;
  const Survey& survey = plan.survey;
  std::vector<std::string> names;
  std::vector<double> parameters, times;
  std::vector<std::uint32_t> samples;
  for (std::uint32_t run = 0; run < info.simulations; ++run) {
    names.push_back(ensemble.runs[run].name);
    parameters.insert(parameters.end(), ensemble.runs[run].parameters.begin(), ensemble.runs[run].parameters.end());
    times.insert(times.end(), survey.runs[run].times_s.begin(), survey.runs[run].times_s.end());
    for (const std::uint32_t step : survey.runs[run].steps) samples.insert(samples.end(), {run, step});
  }
  sections.add_text(SectionId::length_unit, joined(std::array{plan.description.length_unit}));
  sections.add_text(SectionId::simulation_names, joined(names));
  sections.add_text(SectionId::parameter_names, joined(ensemble.parameter_names));
  sections.add<double>(SectionId::parameters, 0, {info.simulations, info.parameters}, parameters);
  sections.add<std::uint32_t>(SectionId::samples, 0, {info.samples, 2}, samples);
  sections.add<double>(SectionId::sample_times, 0, {info.samples}, times);
}

void add_component(SmallSections& sections, const format::Info& info, const Survey& survey) {
  const CommonMesh& mesh = survey.mesh;
  std::vector<std::uint32_t> element_nodes;
  for (const Quad& element : mesh.elements) element_nodes.insert(element_nodes.end(), element.begin(), element.end());
  std::vector<std::string> field_names;
  for (const SimulationField& field : survey.fields) field_names.insert(field_names.end(), {field.name, field.unit});
  const std::vector<std::uint32_t> at_elements(info.fields, 0);
  sections.add<std::uint32_t>(SectionId::node_ids, 0, {info.nodes}, mesh.node_ids);
  sections.add<std::uint32_t>(SectionId::element_ids, 0, {info.elements}, mesh.element_ids);
  sections.add<std::uint32_t>(SectionId::element_parts, 0, {info.elements}, mesh.element_parts);
  sections.add<std::uint32_t>(SectionId::element_nodes, 0, {info.elements, 4}, element_nodes);
  sections.add_text(SectionId::field_names, joined(field_names));
  sections.add<std::uint32_t>(SectionId::field_locations, 0, {info.fields}, at_elements);
}

// Psi' M in the runtime's layout: single precision, rows padded with zeros.
std::vector<float> padded_rows(const Eigen::MatrixXd& matrix) {
  const std::size_t stride = format::padded(static_cast<std::size_t>(matrix.cols()));
  std::vector<float> rows(static_cast<std::size_t>(matrix.rows()) * stride, 0.0f);
  for (Eigen::Index i = 0; i < matrix.rows(); ++i)
    for (Eigen::Index j = 0; j < matrix.cols(); ++j)
      rows[static_cast<std::size_t>(i) * stride + static_cast<std::size_t>(j)] = static_cast<float>(matrix(i, j));
  return rows;
}

template <typename T, std::size_t N>
std::span<const T> flat(const std::vector<std::array<T, N>>& rows) {
  return {rows.empty() ? nullptr : rows.front().data(), N * rows.size()};
}

std::span<const double> values(const Eigen::VectorXd& vector) {
  return {vector.data(), static_cast<std::size_t>(vector.size())};
}

void add_reference(SmallSections& sections, const format::Info& info, std::uint32_t part,
                   const ReferenceBasis& reference) {
  const std::uint64_t n = info.vertices, p = info.modes, t = reference.tree.ranges.size();
  sections.add<std::uint32_t>(SectionId::vertex_nodes, part, {n}, reference.vertex_nodes);
  sections.add<float>(SectionId::vertex_positions, part, {n, 3}, flat(reference.vertex_positions));
  sections.add<double>(SectionId::mass, part, {n}, values(reference.mass));
  sections.add<double>(SectionId::eigenvalues, part, {p}, values(reference.eigenvalues));
  sections.add<float>(SectionId::projection, part, {p, format::padded(n)}, padded_rows(reference.projection));
  sections.add<float>(SectionId::tree_boxes, part, {t, 6}, flat(reference.tree.boxes));
  sections.add<std::uint32_t>(SectionId::tree_ranges, part, {t, 3}, flat(reference.tree.ranges));
}

void add_channels(SmallSections& sections, const BakePlan& plan) {
  if (plan.channels.empty()) return;
  std::vector<std::string> names, histories;
  std::vector<std::uint32_t> rows;
  for (const PlannedChannel& channel : plan.channels) {
    names.insert(names.end(), {channel.name, channel.unit});
    ChannelRow row{static_cast<std::uint32_t>(channel.kind), static_cast<std::uint32_t>(channel.component), channel.cfc,
                   static_cast<std::uint32_t>(channel.nodes.size())};
    if (is_of_field(channel.kind)) row.node_ids = {channel.field, count32(channel.elements.size(), "elements"), 0, 0};
    if (channel.kind == ChannelKind::history) {
      row.node_ids = {static_cast<std::uint32_t>(channel.history.owner), channel.history.number, 0, 0};
      histories.push_back(channel.history.name);
    }
    for (std::size_t k = 0; k < channel.nodes.size(); ++k)
      row.node_ids[k] = plan.survey.mesh.node_ids[channel.nodes[k]];
    const auto words = std::bit_cast<std::array<std::uint32_t, channel_words>>(row);
    rows.insert(rows.end(), words.begin(), words.end());
  }
  sections.add_text(SectionId::channel_names, joined(names));
  sections.add<std::uint32_t>(SectionId::channel_kinds, 0, {plan.channels.size(), channel_words}, rows);
  if (!histories.empty()) sections.add_text(SectionId::channel_histories, joined(histories));
}

format::Info model_info(const BakePlan& plan, const std::vector<ReferenceBasis>& references,
                        const EnvelopeGrid& envelope) {
  const Survey& survey = plan.survey;
  format::Info info{};
  info.reference_mode = static_cast<std::uint32_t>(plan.description.mode);
  info.vertices = count32(references.front().vertex_nodes.size(), "vertices");
  info.modes = plan.description.modes;
  info.samples = count32(survey.samples(), "samples");
  info.simulations = count32(plan.ensemble.runs.size(), "runs");
  info.references = count32(references.size(), "reference meshes");
  info.nodes = count32(survey.mesh.node_ids.size(), "nodes");
  info.elements = count32(survey.mesh.elements.size(), "elements");
  info.fields = count32(survey.fields.size(), "fields");
  info.parameters = count32(plan.ensemble.parameter_names.size(), "parameters");
  info.envelope_cells = envelope.cells;
  return info;
}

SmallSections small_sections(const format::Info& info, const BakePlan& plan,
                             const std::vector<ReferenceBasis>& references, const EnvelopeGrid& envelope) {
  SmallSections sections;
  std::array<std::uint32_t, sizeof(format::Info) / sizeof(std::uint32_t)> words{};
  std::memcpy(words.data(), &info, sizeof(info));
  sections.add<std::uint32_t>(SectionId::info, 0, {words.size()}, words);
  add_ensemble(sections, info, plan);
  add_component(sections, info, plan.survey);
  add_channels(sections, plan);
  const std::array<float, 4> grid{envelope.corner[0], envelope.corner[1], envelope.corner[2], envelope.edge};
  sections.add<float>(SectionId::envelope_grid, 0, {4}, grid);
  std::vector<double> reference_times;
  for (const ReferenceBasis& reference : references) reference_times.push_back(reference.time_s);
  sections.add<double>(SectionId::reference_times, 0, {info.references}, reference_times);
  for (std::uint32_t part = 0; part < info.references; ++part) add_reference(sections, info, part, references[part]);
  return sections;
}

void plan_forecast(std::vector<PlannedSection>& plan, const format::Info& info, std::uint64_t channels) {
  constexpr std::uint64_t windows = ForecastWindow::count, most = LearnedForecast::most_components,
                          scores = LearnedForecast::shape_scores;
  const std::uint64_t runs = LearnedForecast::trained_runs(info.simulations), p = info.parameters;
  plan.push_back({SectionId::window_numbers,
                  0,
                  ElementType::f64,
                  {LearnedForecast::kinds, 1 + windows, LearnedForecast::numbers_per_window(p)}});
  plan.push_back({SectionId::window_means,
                  0,
                  ElementType::f32,
                  {1 + std::uint64_t{LearnedForecast::nodes} * LearnedForecast::means_per_node, scores}});
  plan.push_back({SectionId::window_components, 0, ElementType::f32, {LearnedForecast::all_sizes, most, scores}});
  plan.push_back({SectionId::window_variances, 0, ElementType::f32, {windows, most}});
  plan.push_back({SectionId::window_runs, 0, ElementType::f32, {windows, runs, most}});
  plan.push_back({SectionId::window_parameters, 0, ElementType::f32, {windows, p, most}});
  if (channels == 0) return;
  plan.push_back({SectionId::channel_numbers,
                  0,
                  ElementType::f64,
                  {LearnedForecast::kinds, 1 + windows, channels * LearnedForecast::numbers_per_channel}});
  plan.push_back({SectionId::channel_products,
                  0,
                  ElementType::f32,
                  {windows, channels * LearnedForecast::values_per_channel, most}});
}

/// Depth images, and what the bake learns from them; part: of the rig.
void plan_views(std::vector<PlannedSection>& plan, const format::Info& info, const DepthCamera& camera,
                std::uint32_t part) {
  const std::uint64_t s = info.samples;
  plan.push_back({SectionId::view_camera, part, ElementType::f64, {format::depth_camera_words}});
  plan.push_back({SectionId::view_size, part, ElementType::u32, {2}});
  plan.push_back({SectionId::view_depths, part, ElementType::u16, {s, padded_cells(camera)}});
  constexpr std::uint64_t image_scores = ShapeRegression::image_scores, shape_scores = ShapeRegression::shape_scores;
  const std::uint64_t trained = ShapeRegression::trained_with(s);
  plan.push_back({SectionId::regression_numbers, part, ElementType::f64, {5}});
  plan.push_back(
      {SectionId::regression_basis, part, ElementType::f32, {2 + image_scores, ShapeRegression::features(camera)}});
  plan.push_back({SectionId::regression_images, part, ElementType::f32, {trained, image_scores}});
  plan.push_back({SectionId::regression_weights, part, ElementType::f32, {shape_scores, format::padded(trained)}});
  plan.push_back({SectionId::regression_shapes, part, ElementType::f32, {s, shape_scores}});
  plan.push_back({SectionId::pose_numbers, part, ElementType::f64, {2}});
  plan.push_back({SectionId::hidden_numbers, part, ElementType::f64, {3}});
  plan.push_back({SectionId::time_numbers, part, ElementType::f64, {1}});
  plan.push_back({SectionId::spread_bounds, part, ElementType::f64, {std::uint64_t{1} + info.fields, 2}});
  plan.push_back({SectionId::expected_residuals, part, ElementType::f32, {s}});
  plan.push_back({SectionId::pose_spreads, part, ElementType::f64, {PoseSpreads::times, 6, 6}});
  plan.push_back({SectionId::pose_spreads_by_points, part, ElementType::f64, {PoseSpreads::times, 6, 6}});
  plan.push_back({SectionId::pose_numbers_by_points, part, ElementType::f64, {2}});
  plan.push_back({SectionId::error_growths, part, ElementType::f64, {2, 2}});
  plan.push_back({SectionId::estimate_prices, part, ElementType::f64, {all_prices.size()}});
}

/// Sections written sample by sample, and those known at the end.
void plan_large_sections(ModelPlan& model, const BakePlan& bake) {
  const EnsembleDescription& description = bake.description;
  const std::uint64_t channels = bake.channels.size();
  const format::Info& info = model.info;
  std::vector<PlannedSection>& plan = model.sections;
  const std::uint64_t s = info.samples, n = info.vertices;
  const std::uint64_t cells = std::uint64_t{info.envelope_cells[0]} * info.envelope_cells[1] * info.envelope_cells[2];
  plan.push_back({SectionId::provenance, 0, ElementType::u8, {model.provenance_size}});
  plan.push_back({SectionId::node_positions, 0, ElementType::f32, {s, info.nodes, 3}});
  for (std::uint32_t field = 0; field < info.fields; ++field) plan_field(plan, info, field, description.compact_fields);
  plan.push_back({SectionId::envelope_bits, 0, ElementType::u64, {(cells + 63) / 64}});
  for (std::uint32_t part = 0; part < info.references; ++part) {
    plan.push_back({SectionId::coefficients, part, ElementType::f32, {s, 3, format::padded(info.modes)}});
    if (description.correspondence) plan.push_back({SectionId::correspondence, part, ElementType::u32, {s, n}});
    plan.push_back({SectionId::leading_axes, part, ElementType::u32, {3}});
  }
  plan.push_back({SectionId::simulation_branches, 0, ElementType::u32, {info.simulations}});
  if (has_landmarks(info, description)) plan_landmarks(plan, info);
  if (bake.survey.lacks_elements())
    plan.push_back({SectionId::eroded_elements, 0, ElementType::u32, {s, format::words_of_elements(info.elements)}});
  if (channels > 0) plan.push_back({SectionId::channel_values, 0, ElementType::f32, {channels, s}});
  if (!bake.camera) return;
  plan_views(plan, info, *bake.camera, 0);
  for (std::uint32_t rig = 0; rig < bake.more_cameras.size(); ++rig)
    plan_views(plan, info, bake.more_cameras[rig], rig + 1);
  if (channels > 0)
    plan.push_back({SectionId::channel_bounds, 0, ElementType::f64, {channels, LearnedChannels::kinds, 3}});
  plan_forecast(plan, info, channels);
}

}  // namespace

void SmallSections::add_text(SectionId id, const std::string& text) { add<char>(id, 0, {text.size()}, text); }

void SmallSections::plan(std::vector<PlannedSection>& plan) const {
  for (const Section& section : sections_) plan.push_back(section.plan);
}

void SmallSections::write(ModelWriter& writer) const {
  for (const Section& section : sections_) writer.write_bytes(section.plan.id, section.plan.part, 0, section.bytes);
}

ModelPlan plan_model(const BakePlan& plan, const std::vector<ReferenceBasis>& bases, const EnvelopeGrid& envelope,
                     const std::vector<std::string>& left_out) {
  ModelPlan model;
  model.info = model_info(plan, bases, envelope);
  model.small = small_sections(model.info, plan, bases, envelope);
  // The length is planned before the kept variance is known; blanks fill the rest.
  model.provenance_size = provenance_json(plan, bases, 0, left_out).size() + 32;
  model.small.plan(model.sections);
  plan_large_sections(model, plan);
  return model;
}

void write_learned_fit(ModelWriter& writer, const DepthCamera& camera, const LearnedFit& learned, std::uint32_t part) {
  format::DepthCameraWords words{{},
                                 double{camera.focal},
                                 double{camera.center_column},
                                 double{camera.center_row},
                                 double{camera.depth_origin},
                                 double{camera.depth_step},
                                 double{learned.limits.frame},
                                 double{learned.limits.test},
                                 double{learned.costs.metric.cap},
                                 double{learned.costs.metric.one_sided},
                                 learned.hidden_error_bound.per_spread};
  std::ranges::copy(camera.T_reference_sensor, words.T_reference_sensor.begin());
  writer.write_bytes(SectionId::view_camera, part, 0, std::as_bytes(std::span(&words, 1)));
  writer.write<std::uint32_t>(SectionId::view_size, part, 0, std::array{camera.columns, camera.rows});
  writer.write<float>(SectionId::expected_residuals, part, 0, learned.expected);
  const TrainedShapes& shapes = learned.shapes;
  writer.write<double>(SectionId::regression_numbers, part, 0,
                       std::array{double{shapes.one_sided}, double{shapes.length_scale}, double{shapes.blend},
                                  double{shapes.most_difference}, learned.error_bound.per_spread});
  writer.write<float>(SectionId::regression_basis, part, 0, shapes.basis);
  writer.write<float>(SectionId::regression_images, part, 0, shapes.images);
  writer.write<float>(SectionId::regression_weights, part, 0, shapes.weights);
  writer.write<float>(SectionId::regression_shapes, part, 0, shapes.shapes);
  writer.write<double>(SectionId::pose_numbers, part, 0,
                       std::array{learned.pose.variance, learned.pose.by_image.drift_evidence});
  const PoseErrors by_points = learned.pose.by_points.value_or(PoseErrors());
  writer.write<double>(SectionId::pose_numbers_by_points, part, 0,
                       std::array{learned.pose.by_points ? 1.0 : 0.0, by_points.drift_evidence});
  for (std::size_t i = 0; i < PoseSpreads::times; ++i) {
    writer.write<double>(SectionId::pose_spreads, part, 36 * i, learned.pose.by_image.spreads.at_times[i]);
    writer.write<double>(SectionId::pose_spreads_by_points, part, 36 * i, by_points.spreads.at_times[i]);
  }
  writer.write<double>(SectionId::hidden_numbers, part, 0,
                       std::array{double{learned.costs.metric.hidden}, double{shapes.hidden_blend},
                                  double{shapes.hidden_most_difference}});
  std::array<double, all_prices.size()> prices{};
  std::ranges::transform(all_prices, prices.begin(), [&](auto price) { return double{learned.costs.prices.*price}; });
  writer.write<double>(SectionId::estimate_prices, part, 0, prices);
  writer.write<double>(SectionId::error_growths, part, 0,
                       std::array{learned.error_bound.growth, learned.error_bound.typical,
                                  learned.hidden_error_bound.growth, learned.hidden_error_bound.typical});
  writer.write<double>(SectionId::time_numbers, part, 0, std::array{double{learned.time_variation}});
  for (std::size_t i = 0; i < learned.bounds.size(); ++i)
    writer.write<double>(SectionId::spread_bounds, part, 2 * i,
                         std::array{learned.bounds[i].share, learned.bounds[i].per_spread});
}

void write_channel_bounds(ModelWriter& writer, const LearnedFit& learned) {
  for (std::size_t channel = 0; channel < learned.channels.size(); ++channel)
    for (std::size_t kind = 0; kind < LearnedChannels::kinds; ++kind)
      writer.write<double>(SectionId::channel_bounds, 0, 3 * (LearnedChannels::kinds * channel + kind),
                           std::bit_cast<std::array<double, 3>>(learned.channels[channel][kind]));
}

void write_forecast(ModelWriter& writer, const TrainedForecast& forecast) {
  writer.write<double>(SectionId::window_numbers, 0, 0, forecast.numbers);
  writer.write<float>(SectionId::window_means, 0, 0, forecast.means);
  writer.write<float>(SectionId::window_components, 0, 0, forecast.components);
  writer.write<float>(SectionId::window_variances, 0, 0, forecast.variances);
  writer.write<float>(SectionId::window_runs, 0, 0, forecast.runs);
  writer.write<float>(SectionId::window_parameters, 0, 0, forecast.parameters);
  if (forecast.channel_numbers.empty()) return;
  writer.write<double>(SectionId::channel_numbers, 0, 0, forecast.channel_numbers);
  writer.write<float>(SectionId::channel_products, 0, 0, forecast.channel_products);
}

using format::ElementType;
using format::SectionId;

void plan_field(std::vector<PlannedSection>& plan, const format::Info& info, std::uint32_t field, bool is_compact) {
  if (!is_compact) {
    plan.push_back({SectionId::field_values, field, ElementType::f32, {info.samples, info.elements}});
    return;
  }
  plan.push_back({SectionId::field_codes, field, ElementType::u16, {info.samples, info.elements}});
  plan.push_back({SectionId::field_ranges, field, ElementType::f32, {info.samples, 3}});
}

void FieldSections::write(std::uint32_t field, std::uint64_t sample, std::span<const float> values) {
  if (!is_compact_) return writer_.write<float>(SectionId::field_values, field, sample * values.size(), values);
  const FieldRange range = range_of_field(values);
  codes_.resize(values.size());
  std::ranges::transform(values, codes_.begin(), [&](float value) { return encoded(value, range); });
  const std::array<float, 3> words{range.low, range.high, largest_error(range)};
  writer_.write<FieldCode>(SectionId::field_codes, field, sample * codes_.size(), codes_);
  writer_.write<float>(SectionId::field_ranges, field, sample * words.size(), words);
  errors_[field] = std::max(errors_[field], words.back());
}

void FieldSections::read(std::uint32_t field, std::uint64_t sample, std::span<float> values) const {
  if (!is_compact_) return writer_.read<float>(SectionId::field_values, field, sample * values.size(), values);
  std::vector<FieldCode> codes(values.size());
  std::array<float, 3> words{};
  writer_.read<FieldCode>(SectionId::field_codes, field, sample * codes.size(), codes);
  writer_.read<float>(SectionId::field_ranges, field, sample * words.size(), words);
  decode(codes, {words[0], words[1]}, values);
}

bool has_landmarks(const format::Info& info, const EnsembleDescription& description) noexcept {
  constexpr std::uint64_t most_without_landmarks = std::uint64_t{1} << 30;  // bytes of positions
  return description.landmarks.value_or(std::uint64_t{info.samples} * info.nodes >
                                        most_without_landmarks / (3 * sizeof(float)));
}

void plan_landmarks(std::vector<PlannedSection>& plan, const format::Info& info) {
  const std::uint64_t landmarks =
      std::uint64_t{format::surface_landmarks(info.vertices)} + format::mesh_landmarks(info.nodes);
  plan.push_back({format::SectionId::landmark_positions, 0, format::ElementType::f32, {info.samples, landmarks, 3}});
}

LandmarkSection::LandmarkSection(ModelWriter& writer, const format::Info& info, const ReferenceBasis& first)
    : writer_(writer) {
  const std::uint32_t surface = format::surface_landmarks(info.vertices), mesh = format::mesh_landmarks(info.nodes);
  for (std::uint32_t k = 0; k < surface; ++k)
    nodes_.push_back(first.vertex_nodes[format::landmark_vertex(k, surface, info.vertices)]);
  for (std::uint32_t k = 0; k < mesh; ++k) nodes_.push_back(format::part_begin(k, mesh, info.nodes));
  row_.resize(3 * nodes_.size());
}

void LandmarkSection::write(std::uint64_t sample, std::span<const float> positions) {
  for (std::size_t i = 0; i < nodes_.size(); ++i) std::copy_n(&positions[std::size_t{3} * nodes_[i]], 3, &row_[3 * i]);
  writer_.write<float>(format::SectionId::landmark_positions, 0, sample * row_.size(), row_);
}

}  // namespace lbea::bake
