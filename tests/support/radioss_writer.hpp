// Writes OpenRadioss animation files for tests of the reader, independently of its code, from the order in which the
// solver's public converter to VTK reads them.
#pragma once

#include <bit>
#include <cstdint>
#include <string>
#include <utility>
#include <vector>

namespace lbea::test {
/// Elements of one kind, with the blocks of its section.
struct RadiossSection {
  std::vector<std::uint32_t> nodes;  // corners of all elements
  std::vector<std::uint32_t> ids;
  std::string alive;                                         // a byte each, not 0: alive
  std::vector<std::pair<std::uint32_t, std::string>> parts;  // where each ends, and its text, which begins with the id
  std::vector<std::pair<std::string, std::vector<float>>> scalars;
  std::size_t tensors = 0;

  [[nodiscard]] std::size_t size() const { return alive.size(); }
};

struct RadiossAnimation {
  float time = 0;
  bool has_masses = false, has_ids = true, has_hierarchy = false, has_solids = false;
  std::size_t frames = 0;
  std::vector<float> positions;
  std::vector<std::uint32_t> node_ids;
  std::vector<std::pair<std::string, std::vector<float>>> node_scalars, node_vectors;
  RadiossSection shells, solids;
};

class RadiossWriter {
 public:
  explicit RadiossWriter(const RadiossAnimation& a) : a_(a) {}

  std::string bytes() {
    integer(0x542c);
    real(a_.time);
    for (const char* text : {"Time=", "a model", "a run"}) this->text(text, 81);
    for (const bool flag : {a_.has_masses, a_.has_ids, a_.has_solids, false, a_.has_hierarchy}) integer(flag ? 1 : 0);
    for (int i = 5; i < 10; ++i) integer(0);
    write_nodes_and_shells();
    if (a_.has_solids) write_solids();
    return std::move(bytes_);
  }

 private:
  void write_nodes_and_shells() {
    const std::size_t nodes = a_.positions.size() / 3;
    for (const std::size_t count : {nodes, a_.shells.size(), a_.shells.parts.size(), a_.node_scalars.size(),
                                    a_.shells.scalars.size(), a_.node_vectors.size(), a_.shells.tensors, a_.frames})
      integer(static_cast<std::uint32_t>(count));
    bytes_.append(a_.frames * 6 * 2, '\7');
    for (const float value : a_.positions) real(value);
    write_elements(a_.shells);
    bytes_.append(nodes * 3 * 2, '\7');  // normals
    for (const auto& [name, values] : a_.node_scalars) text(name, 81);
    for (const auto& [name, values] : a_.shells.scalars) text(name, 81);
    write_values(a_.node_scalars);
    write_values(a_.shells.scalars);
    for (const auto& [name, values] : a_.node_vectors) text(name, 81);
    write_values(a_.node_vectors);
    write_tensors(a_.shells, 3);
    if (a_.has_masses) bytes_.append((a_.shells.size() + nodes) * 4, '\7');
    if (a_.has_ids)
      for (const std::uint32_t id : a_.node_ids) integer(id);
    write_end(a_.shells);
  }

  void write_solids() {
    for (const std::size_t count :
         {a_.solids.size(), a_.solids.parts.size(), a_.solids.scalars.size(), a_.solids.tensors})
      integer(static_cast<std::uint32_t>(count));
    write_elements(a_.solids);
    for (const auto& [name, values] : a_.solids.scalars) text(name, 81);
    write_values(a_.solids.scalars);
    write_tensors(a_.solids, 6);
    if (a_.has_masses) bytes_.append(a_.solids.size() * 4, '\7');
    write_end(a_.solids);
  }

  void write_elements(const RadiossSection& section) {
    for (const std::uint32_t node : section.nodes) integer(node);
    bytes_ += section.alive;
    for (const auto& [end, name] : section.parts) integer(end);
    for (const auto& [end, name] : section.parts) text(name, 50);
  }
  void write_values(const std::vector<std::pair<std::string, std::vector<float>>>& arrays) {
    for (const auto& [name, values] : arrays)
      for (const float value : values) real(value);
  }
  void write_tensors(const RadiossSection& section, std::size_t components) {
    for (std::size_t i = 0; i < section.tensors; ++i) text("Stress", 81);
    bytes_.append(section.tensors * section.size() * components * 4, '\7');
  }
  void write_end(const RadiossSection& section) {
    if (a_.has_ids)
      for (const std::uint32_t id : section.ids) integer(id);
    if (a_.has_hierarchy) bytes_.append(section.parts.size() * 3 * 4, '\7');
  }

  void integer(std::uint32_t value) {
    for (int shift = 24; shift >= 0; shift -= 8) bytes_ += static_cast<char>(value >> shift);
  }
  void real(float value) { integer(std::bit_cast<std::uint32_t>(value)); }
  void text(const std::string& value, std::size_t size) { bytes_ += value + std::string(size - value.size(), '\0'); }

  const RadiossAnimation& a_;
  std::string bytes_;
};
}  // namespace lbea::test
