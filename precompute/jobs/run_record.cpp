#include "precompute/jobs/run_record.hpp"

#include "precompute/jobs/archive.hpp"
#include "runtime/src/model/model_format.hpp"

namespace lbea::bake {

// Not in an unnamed namespace: the archive finds it by its arguments.
static void members(auto& a, Moments& m) {
  a(m.samples, m.squared_positions, m.squared_coefficients, m.sum_positions, m.sum_coefficients, m.sum_squares);
}

namespace {

// The order in which a sample's rows lie in the file.
void for_each_row(auto& sample, const auto& row) {
  row(sample.positions);
  for (auto& field : sample.fields) row(field);
  for (std::size_t reference = 0; reference < sample.coefficients.size(); ++reference) {
    row(sample.coefficients[reference]);
    if (!sample.correspondence.empty()) row(sample.correspondence[reference]);
  }
}

}  // namespace

SampleRecord::SampleRecord(const BakePlan& plan, const std::vector<ReferenceBasis>& bases)
    : positions(3 * plan.survey.mesh.node_ids.size()),
      fields(plan.survey.fields.size(), std::vector<float>(plan.survey.mesh.elements.size())) {
  for (const ReferenceBasis& basis : bases) {
    coefficients.emplace_back(3 * format::padded(static_cast<std::size_t>(basis.projection.rows())));
    if (plan.description.correspondence) correspondence.emplace_back(basis.vertex_nodes.size());
  }
}

std::size_t SampleRecord::bytes() const {
  std::size_t sum = 0;
  for_each_row(*this, [&](const auto& row) { sum += std::as_bytes(std::span(row)).size(); });
  return sum;
}

void write_sample(WorkWriter& file, const SampleRecord& sample) {
  for_each_row(sample, [&](const auto& row) { file.bytes(std::as_bytes(std::span(row))); });
}

void read_sample(WorkReader& file, SampleRecord& sample) {
  for_each_row(sample, [&](auto& row) { file.bytes(std::as_writable_bytes(std::span(row))); });
}

void write_moments(WorkWriter& file, const std::vector<Moments>& moments) { Saver{file}(moments); }

std::vector<Moments> read_moments(WorkReader& file) {
  std::vector<Moments> moments;
  Loader{file}(moments);
  return moments;
}

}  // namespace lbea::bake
