#include "tests/support/d3plot_writer.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <fstream>

namespace lbea::test {
namespace {

constexpr double end_marker = -999999.0;
constexpr std::size_t block_words = 512;
constexpr int rigid = 20;

class Words {
 public:
  explicit Words(const D3plot& database) : database_(&database) {}

  void integer(std::int64_t value) {
    if (database_->word_bytes == 4)
      append(static_cast<std::int32_t>(value));
    else
      append(value);
  }
  void real(double value) {
    if (database_->word_bytes == 4)
      append(static_cast<float>(value));
    else
      append(value);
  }
  template <typename Range>
  void reals(const Range& values) {
    for (const double value : values) real(value);
  }
  /// Words that a reader must skip.
  void noise(std::size_t count) {
    for (std::size_t i = 0; i < count; ++i) real(1e6 + static_cast<double>(bytes_.size() % 977));
  }
  void text(const std::string& text, std::size_t length) {
    for (std::size_t i = 0; i < length; ++i) bytes_.push_back(static_cast<std::byte>(i < text.size() ? text[i] : ' '));
  }
  void pad() { bytes_.resize((size() + block_words - 1) / block_words * block_words * database_->word_bytes); }
  std::size_t size() const { return bytes_.size() / database_->word_bytes; }
  std::vector<std::byte> take() { return std::move(bytes_); }

 private:
  template <typename Value>
  void append(Value value) {
    std::array<std::byte, sizeof(Value)> raw{};
    std::memcpy(raw.data(), &value, sizeof value);
    if (database_->is_big_endian) std::reverse(raw.begin(), raw.end());
    bytes_.insert(bytes_.end(), raw.begin(), raw.end());
  }

  const D3plot* database_;
  std::vector<std::byte> bytes_;
};

bool has_material_types(const D3plot& d) { return d.ndim == 5 || d.ndim == 7; }
bool is_rigid(const D3plot& d, std::size_t shell) {
  return has_material_types(d) && d.material_types.at(static_cast<std::size_t>(d.shell_parts[shell] - 1)) == rigid;
}
std::size_t point_words(const D3plot& d) {
  return (d.has_stress ? 6u : 0u) + (d.has_plastic_strain ? 1u : 0u) + d.history;
}
std::size_t shell_words(const D3plot& d) {
  return d.layers * point_words(d) + (d.has_forces ? 8u : 0u) + (d.has_extra ? 4u : 0u) + (d.has_strain ? 12u : 0u);
}
std::size_t thick_shells(const D3plot& d) { return d.thick_shells + d.thick_shell_nodes.size(); }
std::size_t thick_shell_words(const D3plot& d) { return d.thick_shell_nodes.empty() ? 7 : d.layers * point_words(d); }
std::size_t numbering_words(const D3plot& d) {
  if (!d.has_numbering) return 0;
  return (d.has_part_ids ? 16u : 10u) + d.nodes.size() + d.solids.size() + d.beams + d.shells.size() + thick_shells(d) +
         3 * d.parts;
}

void write_control(Words& words, const D3plot& d) {
  constexpr std::size_t beam_words = 6;
  const auto flag = [](bool is_set) { return is_set ? 1000 : 0; };
  const int maxint = static_cast<int>(d.layers);
  const auto n = [](std::size_t size) { return static_cast<std::int64_t>(size); };
  std::map<std::size_t, std::int64_t> control{{11, d.file_type},
                                              {15, d.ndim},
                                              {16, n(d.nodes.size())},
                                              {17, 6},
                                              {18, n(d.globals)},
                                              {19, d.it},
                                              {20, d.iu},
                                              {21, d.iv},
                                              {22, d.ia},
                                              {23, n(d.solids.size())},
                                              {27, n(d.solid_points * point_words(d))},
                                              {28, n(d.beams)},
                                              {30, n(beam_words)},
                                              {31, n(d.shells.size())},
                                              {33, n(shell_words(d))},
                                              {34, n(d.history)},
                                              {35, n(d.history)},
                                              {36, d.deletion == D3plot::Deletion::elements ? -10000 - maxint
                                                   : d.deletion == D3plot::Deletion::nodes  ? -maxint
                                                                                            : maxint},
                                              {39, n(numbering_words(d))},
                                              {40, n(thick_shells(d))},
                                              {42, n(thick_shell_words(d))},
                                              {43, flag(d.has_stress)},
                                              {44, flag(d.has_plastic_strain)},
                                              {45, flag(d.has_forces)},
                                              {46, flag(d.has_extra)},
                                              {51, n(d.parts)},
                                              {55, n(d.eight_node_shells)},
                                              {56, d.idtdt},
                                              {57, n(d.extra_words)}};
  if (d.extra_words > 1) control[65] = n(d.solid_thermal);
  for (const auto& [word, value] : d.overrides) control[word] = value;
  words.text(d.title, 10 * d.word_bytes);
  for (std::size_t word = 10; word < 64 + d.extra_words; ++word)
    word == 14 ? words.real(d.version) : words.integer(control.contains(word) ? control.at(word) : 0);
}

void write_ids(Words& words, const std::vector<int>& ids, std::size_t count) {
  for (std::size_t i = 0; i < count; ++i) words.integer(i < ids.size() ? ids[i] : static_cast<int>(i) + 1);
}

void write_numbering(Words& words, const D3plot& d) {
  if (!d.has_numbering) return;
  words.integer(d.has_part_ids ? -1 : 1);
  for (int pointer = 0; pointer < 4; ++pointer) words.integer(pointer);
  for (const std::size_t count : {d.nodes.size(), d.solids.size(), d.beams, d.shells.size(), thick_shells(d)})
    words.integer(static_cast<std::int64_t>(count));
  if (d.has_part_ids) write_ids(words, {}, 6);
  write_ids(words, d.node_ids, d.nodes.size());
  write_ids(words, d.solid_ids, d.solids.size());
  write_ids(words, {}, d.beams);
  write_ids(words, d.shell_ids, d.shells.size());
  write_ids(words, d.thick_shell_ids, thick_shells(d));
  for (int list = 0; list < 3; ++list) write_ids(words, d.part_ids, d.parts);
}

void write_road(Words& words) {
  for (const int value : {2, 1, 1, 1}) words.integer(value);  // nodes, segments, surfaces, motion
  words.noise(2 * 4);
  words.integer(77);
  words.integer(1);
  words.noise(4);
}

void write_geometry(Words& words, const D3plot& d) {
  if (has_material_types(d)) {
    std::int64_t rigid_shells = 0;
    for (std::size_t s = 0; s < d.shells.size(); ++s) rigid_shells += is_rigid(d, s) ? 1 : 0;
    words.integer(rigid_shells);
    words.integer(static_cast<std::int64_t>(d.material_types.size()));
    for (const int type : d.material_types) words.integer(type);
  }
  for (const auto& node : d.nodes) words.reals(node);
  for (std::size_t s = 0; s < d.solids.size(); ++s) {
    for (const std::uint32_t node : d.solids[s]) words.integer(node + 1);
    words.integer(d.solid_parts[s]);
  }
  for (const auto& thick_shell : d.thick_shell_nodes) {
    for (const std::uint32_t node : thick_shell) words.integer(node + 1);
    words.integer(1);
  }
  for (std::size_t i = 0; i < 9 * d.thick_shells + 6 * d.beams; ++i) words.integer(1);
  for (std::size_t s = 0; s < d.shells.size(); ++s) {
    for (const std::uint32_t node : d.shells[s]) words.integer(node + 1);
    words.integer(d.shell_parts[s]);
  }
  write_numbering(words, d);
  if (d.ndim == 7) write_road(words);
  words.noise(5 * d.eight_node_shells);
}

void write_titles(Words& words, const D3plot& d) {
  words.real(end_marker);
  if (!d.has_titles) return;
  words.integer(90001);
  words.integer(static_cast<std::int64_t>(d.parts));
  for (std::size_t part = 0; part < d.parts; ++part) {
    words.integer(static_cast<std::int64_t>(part) + 1);
    words.text("a part", 72);
  }
  words.integer(90000);
  words.text(d.title, 72);
  words.real(end_marker);
}

void write_nodes(Words& words, const D3plot& d, const D3plotState& state) {
  const std::size_t n = d.nodes.size();
  if (d.iu != 0)
    for (const auto& node : state.positions) words.reals(node);
  const int temperature = d.it % 10;
  words.noise(n * (temperature == 1 ? 1u : temperature == 2 ? 4u : temperature == 3 ? 6u : 0u));
  words.noise(n * (d.it / 10 == 1 ? 1u : 0u));
  words.noise(n * ((d.idtdt % 10 == 1 ? 1u : 0u) + (d.idtdt / 10 % 10 == 1 ? 6u : 0u)));
  words.noise(n * 3 * ((d.iv != 0 ? 1u : 0u) + (d.ia != 0 ? 1u : 0u)));
}

void write_point(Words& words, const D3plot& d, const D3plotPoint& point) {
  if (d.has_stress) words.reals(point.stress);
  if (d.has_plastic_strain) words.real(point.plastic_strain);
  words.reals(point.history);
}

void write_shell(Words& words, const D3plot& d, const D3plotShellResult& shell) {
  for (const D3plotPoint& layer : shell.layers) write_point(words, d, layer);
  if (d.has_forces) words.noise(8);
  if (d.has_extra) {
    words.real(shell.thickness);
    words.noise(2);
  }
  if (d.has_strain)
    for (const auto& surface : shell.strain) words.reals(surface);
  if (d.has_extra) words.real(shell.internal_energy);
}

void write_state(Words& words, const D3plot& d, const D3plotState& state) {
  words.real(state.time);
  if (state.globals.empty()) words.noise(d.globals);
  words.reals(state.globals);
  write_nodes(words, d, state);
  words.noise(d.solids.size() * d.solid_thermal);
  for (const auto& solid : state.solids)
    for (const D3plotPoint& point : solid) write_point(words, d, point);
  for (const auto& thick_shell : state.thick_shells)
    for (const D3plotPoint& layer : thick_shell) write_point(words, d, layer);
  words.noise(thick_shell_words(d) * d.thick_shells + 6 * d.beams);
  for (std::size_t s = 0; s < d.shells.size(); ++s)
    if (!is_rigid(d, s) || d.file_type == 5) write_shell(words, d, state.shells[s]);
  if (d.deletion == D3plot::Deletion::nodes) words.reals(state.node_flags);
  if (d.deletion == D3plot::Deletion::elements) {
    words.reals(state.solid_flags);
    words.reals(state.thick_shell_flags);
    words.noise(d.thick_shells);
    words.reals(state.shell_flags);
    words.noise(d.beams);
  }
  if (d.ndim == 7) words.noise(6);
}

}  // namespace

std::vector<std::vector<std::byte>> d3plot_files(const D3plot& d) {
  std::vector<std::vector<std::byte>> files;
  Words words(d);
  write_control(words, d);
  write_geometry(words, d);
  write_titles(words, d);
  const auto finish = [&] {
    words.pad();
    files.push_back(words.take());
    words = Words(d);
  };
  std::size_t in_file = 0;
  if (d.states_per_file > 0) finish();
  for (const D3plotState& state : d.states) {
    write_state(words, d, state);
    if (++in_file != d.states_per_file) continue;
    in_file = 0;
    if (d.has_end_markers) words.real(end_marker);
    finish();
  }
  if (d.has_end_markers && words.size() > 0) words.real(end_marker);
  if (words.size() > 0) finish();
  return files;
}

std::filesystem::path write_d3plot(const D3plot& d, const std::filesystem::path& folder, const std::string& name) {
  const auto files = d3plot_files(d);
  for (std::size_t f = 0; f < files.size(); ++f) {
    const std::size_t number = f == 0 ? 0 : f <= d.file_numbers.size() ? d.file_numbers[f - 1] : f;
    const std::string suffix = f == 0 ? "" : (number < 10 ? "0" : "") + std::to_string(number);
    std::ofstream out(folder / (name + suffix), std::ios::binary);
    out.write(reinterpret_cast<const char*>(files[f].data()), static_cast<std::streamsize>(files[f].size()));
  }
  return folder / name;
}

}  // namespace lbea::test
