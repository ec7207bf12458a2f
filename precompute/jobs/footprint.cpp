#include "precompute/jobs/footprint.hpp"

#include "precompute/jobs/archive.hpp"

namespace lbea::bake {

void make_footprint(const WorkFolder& work, const BakePlan& plan, std::size_t run, SampleRecord& buffer,
                    const ViewRenderer* renderer) {
  WorkReader record = work.reader(plan.runs[run].record_name());
  WorkWriter file = work.writer(plan.runs[run].footprint_name());
  EnvelopeBuilder envelope(plan.survey.min, plan.survey.max, plan.description.envelope_margin);
  std::vector<std::uint16_t> image(renderer != nullptr ? padded_cells(renderer->camera()) : 0, empty_cell);
  for (std::size_t sample = 0; sample < plan.survey.runs[run].steps.size(); ++sample) {
    read_sample(record, buffer);
    envelope.add(buffer.positions, plan.survey.mesh.elements);
    if (renderer == nullptr) continue;
    renderer->render(buffer.positions, image);
    file.bytes(std::as_bytes(std::span(image)));
  }
  (void)read_moments(record);
  record.finish();
  Saver{file}(envelope.layout().bits);
  file.commit();
}

FootprintReader::FootprintReader(const WorkFolder& work, const BakePlan& plan, std::size_t run)
    : file_(work.reader(plan.runs[run].footprint_name())) {}

void FootprintReader::envelope(EnvelopeBuilder& into) {
  std::vector<std::uint64_t> bits;
  Loader{file_}(bits);
  file_.finish();
  into.add(bits);
}

}  // namespace lbea::bake
