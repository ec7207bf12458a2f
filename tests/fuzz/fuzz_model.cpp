// Arbitrary bytes as a model, with corrected sizes and checksums so that the later checks are reached: refused, or a
// consistent model that matches a frame.
#include "runtime/src/model/checksum.hpp"
#include "runtime/src/model/eroded_elements.hpp"
#include "runtime/src/model/model_format.hpp"

#include <lbea/lbea.hpp>

#include <algorithm>
#include <cstdlib>
#include <cstring>
#include <vector>

namespace {

using namespace lbea;

struct alignas(64) Line {
  std::byte bytes[64];
};

std::uint64_t checksum_of(std::span<const std::byte> image, std::uint64_t offset, std::uint64_t length) {
  if (offset > image.size() || length > image.size() - offset) return 0;
  return checksum(image.subspan(offset, length));
}

void mend(std::span<std::byte> image) {
  format::Header header;
  if (image.size() < sizeof header) return;
  std::memcpy(&header, image.data(), sizeof header);
  header.file_size = image.size();
  const std::uint64_t room = (image.size() - sizeof header) / sizeof(format::SectionEntry);
  const std::size_t directory_bytes =
      std::min<std::uint64_t>(header.section_count, room) * sizeof(format::SectionEntry);
  const auto directory = image.subspan(sizeof header, directory_bytes);
  for (std::size_t at = 0; at < directory.size(); at += sizeof(format::SectionEntry)) {
    format::SectionEntry entry;
    std::memcpy(&entry, &directory[at], sizeof entry);
    entry.checksum = checksum_of(image, entry.offset, entry.length);
    std::memcpy(&directory[at], &entry, sizeof entry);
  }
  header.directory_checksum = checksum(directory);
  header.header_checksum =
      checksum(std::as_bytes(std::span(&header, 1)).first(offsetof(format::Header, header_checksum)));
  std::memcpy(image.data(), &header, sizeof header);
}

void require(bool holds) {
  if (!holds) std::abort();
}

template <class T>
double sum(std::span<const T> values) {
  double total = 0;
  for (const T value : values) total += static_cast<double>(value);
  return total;
}

/// Reads every array.
double read_all(const Model& model) {
  double total = sum(model.node_ids()) + sum(model.element_ids()) + sum(model.element_parts());
  for (const std::uint32_t node : model.element_nodes()) require(node < model.nodes());
  for (std::uint32_t i = 0; i < model.simulations(); ++i) {
    require(model.branch_of(i) < std::max(model.branches(), 1u));
    total += static_cast<double>(model.simulation_name(i).size());
    for (std::uint32_t k = 0; k < model.parameters(); ++k) total += model.parameter(i, k);
  }
  for (std::uint32_t k = 0; k < model.parameters(); ++k) total += static_cast<double>(model.parameter_name(k).size());
  for (std::uint32_t sample = 0; sample < model.samples(); ++sample) {
    require(model.sample_index(model.sample(sample)) == sample);
    total += model.sample_time_s(sample) + sum(model.node_positions(sample));
    total += sum(std::span<const std::uint8_t>(present_elements(model, sample)));
    for (std::uint32_t field = 0; field < model.fields(); ++field) total += sum(model.field_values(field, sample));
    for (std::uint32_t reference = 0; reference < model.references(); ++reference)
      total += static_cast<double>(model.leading_coordinates(reference, sample)[2]);
  }
  for (std::uint32_t reference = 0; reference < model.references(); ++reference) {
    for (const std::uint32_t node : model.vertex_nodes(reference)) require(node < model.nodes());
    total +=
        sum(model.vertex_positions(reference)) + sum(model.eigenvalues(reference)) + model.reference_time_s(reference);
  }
  return total + static_cast<double>(model.provenance().size() + model.length_unit().size());
}

void match_a_frame(const Model& model, Method method) {
  static const std::vector<Point> points{{0, 0, 0}, {90, 20, 5}, {190, 90, 0}, {40, 45, 1}, {1e30f, 0, 0}};
  MatcherConfig config;
  config.max_points = 8;
  config.method = method;
  Matcher matcher(model, config);
  Frame frame{};
  frame.points = points;
  const MatchResult result = matcher.match(frame);
  for (const Match& match : result.matches) require(model.sample_index(match.sample) < model.samples());
}

/// `choice`: only every fourth input is matched, because matching takes longer than all the rest.
void read(std::span<const std::byte> image, unsigned choice) {
  try {
    const Model model = Model::view(image);
    [[maybe_unused]] const volatile double kept = read_all(model);
    if (choice == 0) match_a_frame(model, Method::lbea);
    if (choice == 1) match_a_frame(model, Method::vtp);
    if (choice == 2) match_a_frame(model, Method::fit);
  } catch (const Error& error) { require(error.what()[0] != '\0'); }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  std::vector<Line> lines(size / sizeof(Line) + 1);
  const auto image = std::as_writable_bytes(std::span(lines)).first(size);
  if (size > 0) std::memcpy(image.data(), data, size);
  unsigned choice = 0;
  for (const std::byte byte : image) choice = 31 * choice + static_cast<unsigned>(byte);
  mend(image);
  read(image, choice % 12);
  return 0;
}
