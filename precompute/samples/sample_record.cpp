#include "precompute/samples/sample_record.hpp"

#include "precompute/work/archive.hpp"
#include "runtime/src/model/eroded_elements.hpp"

#include <numeric>

namespace lbea::bake {
// Not in an unnamed namespace: the archive finds it by argument-dependent lookup.
static void members(auto& a, Moments& m) {
  a(m.samples, m.squared_positions, m.squared_coefficients, m.sum_positions, m.sum_coefficients, m.sum_squares);
}

namespace {
// The order of a sample's rows in the file.
void for_each_row(auto& sample, bool lacks_elements, const auto& row) {
  row(sample.positions);
  for (auto& field : sample.fields) row(field);
  for (std::size_t reference = 0; reference < sample.coefficients.size(); ++reference) {
    row(sample.coefficients[reference]);
    if (!sample.correspondence.empty()) row(sample.correspondence[reference]);
  }
  if (lacks_elements) row(sample.eroded);
}

std::vector<Quad> present_ones(const std::vector<Quad>& elements, std::span<const std::uint8_t> present) {
  std::vector<Quad> kept;
  for (std::size_t e = 0; e < elements.size(); ++e)
    if (present[e] != 0) kept.push_back(elements[e]);
  return kept;
}

double squared_in(const Eigen::VectorXd& mass, const Eigen::MatrixXd& f) { return mass.dot(f.rowwise().squaredNorm()); }

void add_to(Eigen::MatrixXd& sum, const Eigen::MatrixXd& term) {
  if (sum.size() == 0)
    sum = term;
  else
    sum += term;
}
}  // namespace

SampleRecord::SampleRecord(const BakePlan& plan, const std::vector<ReferenceBasis>& bases)
    : positions(3 * plan.survey.mesh.node_ids.size()),
      fields(plan.survey.fields.size(), std::vector<float>(plan.survey.mesh.elements.size())),
      eroded(format::words_of_elements(plan.survey.mesh.elements.size())) {
  for (const ReferenceBasis& basis : bases) {
    coefficients.emplace_back(3 * format::padded(static_cast<std::size_t>(basis.projection.rows())));
    if (plan.description.correspondence) correspondence.emplace_back(basis.vertex_nodes.size());
  }
}

std::size_t SampleRecord::bytes() const {
  std::size_t sum = 0;
  for_each_row(*this, true, [&](const auto& row) { sum += std::as_bytes(std::span(row)).size(); });
  return sum;
}

void write_sample(WorkWriter& file, const SampleRecord& sample, const RunSurvey& run) {
  for_each_row(sample, run.lacks_elements, [&](const auto& row) { file.bytes(std::as_bytes(std::span(row))); });
}

void read_sample(WorkReader& file, SampleRecord& sample, const RunSurvey& run) {
  for_each_row(sample, run.lacks_elements, [&](auto& row) { file.bytes(std::as_writable_bytes(std::span(row))); });
  if (!run.lacks_elements) std::ranges::fill(sample.eroded, 0u);
}

void write_moments(WorkWriter& file, const std::vector<Moments>& moments) { Saver{file}(moments); }

std::vector<Moments> read_moments(WorkReader& file) {
  std::vector<Moments> moments;
  Loader{file}(moments);
  return moments;
}

void write_channel_values(WorkWriter& file, const std::vector<float>& values) { Saver{file}(values); }

std::vector<float> read_channel_values(WorkReader& file) {
  std::vector<float> values;
  Loader{file}(values);
  return values;
}

void Moments::add(const Eigen::VectorXd& mass, const Eigen::MatrixXd& positions, const Eigen::MatrixXd& coefficients) {
  samples += 1;
  squared_positions += squared_in(mass, positions);
  squared_coefficients += coefficients.squaredNorm();
  add_to(sum_positions, positions);
  add_to(sum_coefficients, coefficients);
  add_to(sum_squares, coefficients.cwiseAbs2());
}

void Moments::add(const Moments& other) {
  samples += other.samples;
  squared_positions += other.squared_positions;
  squared_coefficients += other.squared_coefficients;
  add_to(sum_positions, other.sum_positions);
  add_to(sum_coefficients, other.sum_coefficients);
  add_to(sum_squares, other.sum_squares);
}

double Moments::total(const Eigen::VectorXd& mass) const {
  return std::max(squared_positions - squared_in(mass, sum_positions) / samples, 0.0);
}

double Moments::kept() const { return std::max(squared_coefficients - sum_coefficients.squaredNorm() / samples, 0.0); }

std::array<std::uint32_t, 3> Moments::leading_axes() const {
  const Eigen::MatrixXd variance = sum_squares - sum_coefficients.cwiseAbs2() / samples;
  std::vector<std::uint32_t> places(static_cast<std::size_t>(variance.size()));
  std::iota(places.begin(), places.end(), 0u);
  const auto at = [&](std::uint32_t place) { return variance(place / 3, place % 3); };
  std::ranges::stable_sort(places, std::ranges::greater{}, at);
  return {places[0], places[std::min<std::size_t>(1, places.size() - 1)],
          places[std::min<std::size_t>(2, places.size() - 1)]};
}

std::unique_ptr<DepthRenderer> planned_renderer(const DepthRendering& rendering, const Survey& survey,
                                                const DepthCamera& planned) {
  auto renderer = rendering ? rendering(survey.mesh, survey.min, survey.max) : nullptr;
  if (renderer == nullptr || camera_key(renderer->camera()) != camera_key(planned))
    throw Error(Status::bad_config, "the sensor description changed since the bake was planned; plan again");
  return renderer;
}

void write_grid_and_images(const WorkFolder& work, const BakePlan& plan, std::size_t run, SampleRecord& buffer,
                           const DepthRenderer* renderer) {
  WorkReader record = work.reader(plan.runs[run].record_name());
  WorkWriter file = work.writer(plan.runs[run].grid_and_images_name());
  EnvelopeBuilder envelope(plan.survey.min, plan.survey.max, plan.description.margin());
  std::vector<std::uint16_t> image(renderer != nullptr ? padded_cells(renderer->camera()) : 0, empty_cell);
  const RunSurvey& survey = plan.survey.runs[run];
  const std::vector<Quad>& elements = plan.survey.mesh.elements;
  std::vector<std::uint8_t> present(survey.lacks_elements ? elements.size() : 0);
  for (std::size_t sample = 0; sample < survey.steps.size(); ++sample) {
    read_sample(record, buffer, survey);
    unpack_eroded(buffer.eroded, present);
    envelope.add(buffer.positions, present.empty() ? elements : present_ones(elements, present));
    if (renderer == nullptr) continue;
    renderer->render(buffer.positions, present, image);
    file.bytes(std::as_bytes(std::span(image)));
  }
  (void)read_moments(record);
  (void)read_channel_values(record);
  record.finish();
  Saver{file}(envelope.layout().bits);
  file.commit();
}

void GridAndImagesReader::envelope(EnvelopeBuilder& into) {
  std::vector<std::uint64_t> bits;
  Loader{file_}(bits);
  file_.finish();
  into.add(bits);
}
}  // namespace lbea::bake
