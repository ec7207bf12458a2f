// Animation files of OpenRadioss (R004A001, R004A002, ...): a state each, 4-byte words in big-endian order.
#include "adapters/files/atomic_file.hpp"
#include "adapters/files/binary_numbers.hpp"
#include "adapters/files/text_line.hpp"
#include "adapters/simulation/grid/grid.hpp"

#include <algorithm>

namespace lbea::io::grid {
namespace {
constexpr std::string_view animation_mark("\0\0\x54\x2c", 4);
constexpr std::size_t name_bytes = 81, part_bytes = 50;
constexpr std::size_t animation_head_bytes = 4 + 4 + 3 * name_bytes;  // mark, time, three texts

/// The blocks of the file, one after the other.
class Words {
 public:
  Words(std::string_view bytes, const std::string& name) : bytes_(bytes), name_(name) {}

  void skip(std::uint64_t count, std::size_t size) { static_cast<void>(take(count, size)); }
  std::uint64_t count() {
    const auto value = static_cast<std::int32_t>(integer(take(1, 4), 0));
    if (value < 0) fail("a count is " + std::to_string(value));
    return static_cast<std::uint64_t>(value);
  }
  std::vector<std::uint32_t> integers(std::uint64_t count) {
    const std::string_view block = take(count, 4);
    std::vector<std::uint32_t> values(count);
    for (std::size_t i = 0; i < count; ++i) values[i] = integer(block, i);
    return values;
  }
  std::vector<double> reals(std::uint64_t count) {
    const std::string_view block = take(count, 4);
    std::vector<double> values(count);
    for (std::size_t i = 0; i < count; ++i) values[i] = static_cast<double>(std::bit_cast<float>(integer(block, i)));
    return values;
  }
  std::vector<double> flags(std::uint64_t count) {  // not 0: the element is alive
    const std::string_view block = take(count, 1);
    std::vector<double> values;
    for (const char byte : block) values.push_back(byte != 0 ? 1 : 0);
    return values;
  }
  std::vector<std::string> texts(std::uint64_t count, std::size_t size) {
    const std::string_view block = take(count, size);
    std::vector<std::string> values;
    for (std::size_t i = 0; i < count; ++i) {
      const std::string_view text = block.substr(i * size, size);
      values.emplace_back(text::trimmed(text.substr(0, text.find('\0'))));
    }
    return values;
  }
  [[noreturn]] void fail(const std::string& what) const {
    throw Error{Status::bad_input, name_ + ", byte " + std::to_string(at_) + ": " + what +
                                       " (OpenRadioss animation file); it is damaged or cut short, copy it again"};
  }

 private:
  std::string_view take(std::uint64_t count, std::size_t size) {
    const std::uint64_t length = binary::times(count, size);
    if (length > bytes_.size() - at_) fail("the file ends within a block of " + std::to_string(length) + " bytes");
    at_ += length;
    return bytes_.substr(at_ - length, length);
  }
  static std::uint32_t integer(std::string_view block, std::size_t at) {
    return static_cast<std::uint32_t>(
        binary::load_bits(reinterpret_cast<const std::byte*>(block.data()) + 4 * at, 4, true));
  }

  std::string_view bytes_;
  const std::string& name_;
  std::size_t at_ = 0;
};

/// What the section of one kind of elements has.
struct Section {
  std::uint64_t elements = 0;
  std::vector<std::uint32_t> nodes, ids;
  std::vector<double> alive, parts;
  std::vector<Array> scalars;
};

class AnimationParser {
 public:
  AnimationParser(std::string_view bytes, const std::string& name) : words_(bytes, name) {}

  Grid parse(bool only_time) {
    words_.skip(1, animation_mark.size());
    grid_.time = words_.reals(1).front();
    if (only_time) return std::move(grid_);
    words_.skip(3, name_bytes);  // of the time, the program and the run
    const auto flags = words_.integers(10);
    has_masses_ = flags[0] == 1;
    has_ids_ = flags[1] != 0;
    has_hierarchy_ = flags[4] != 0;
    const Section shells = read_nodes_and_shells();
    const Section solids = flags[2] != 0 ? read_solids() : Section();
    // beams, particles and lists for other output follow
    add_cells(shells, 4, CellKind::quad);
    add_cells(solids, 8, CellKind::hexahedron);
    add_arrays(shells, solids);
    return std::move(grid_);
  }

 private:
  Section read_nodes_and_shells() {
    Section shells;
    const std::uint64_t nodes = words_.count();
    shells.elements = words_.count();
    const std::uint64_t parts = words_.count(), node_scalars = words_.count(), scalars = words_.count(),
                        vectors = words_.count(), tensors = words_.count(), frames = words_.count();
    words_.skip(frames, 6 * 2);
    const auto positions = words_.reals(3 * nodes);
    grid_.positions.assign(positions.begin(), positions.end());
    shells.nodes = words_.integers(4 * shells.elements);
    shells.alive = words_.flags(shells.elements);
    read_parts(parts, shells);
    words_.skip(3 * nodes, 2);  // normals
    auto names = words_.texts(node_scalars + scalars, name_bytes);
    for (std::uint64_t i = 0; i < node_scalars; ++i)
      grid_.point_arrays.push_back({with_underscores(names[i]), 1, words_.reals(nodes)});
    names.erase(names.begin(), names.begin() + static_cast<std::ptrdiff_t>(node_scalars));
    read_scalars(names, shells);
    names = words_.texts(vectors, name_bytes);
    for (const std::string& name : names)
      grid_.point_arrays.push_back({with_underscores(name), 3, words_.reals(3 * nodes)});
    words_.skip(tensors, name_bytes);
    words_.skip(binary::times(tensors, shells.elements), 3 * 4);
    if (has_masses_) words_.skip(shells.elements + nodes, 4);
    if (has_ids_) {
      const auto ids = words_.integers(nodes);
      grid_.point_arrays.push_back({"NODE_ID", 1, {ids.begin(), ids.end()}});
      shells.ids = words_.integers(shells.elements);
    }
    if (has_hierarchy_) words_.skip(parts, 3 * 4);
    return shells;
  }

  Section read_solids() {
    Section solids;
    solids.elements = words_.count();
    const std::uint64_t parts = words_.count(), scalars = words_.count(), tensors = words_.count();
    solids.nodes = words_.integers(8 * solids.elements);
    solids.alive = words_.flags(solids.elements);
    read_parts(parts, solids);
    read_scalars(words_.texts(scalars, name_bytes), solids);
    words_.skip(tensors, name_bytes);
    words_.skip(binary::times(tensors, solids.elements), 6 * 4);
    if (has_masses_) words_.skip(solids.elements, 4);
    if (has_ids_) solids.ids = words_.integers(solids.elements);
    if (has_hierarchy_) words_.skip(parts, 3 * 4);
    return solids;
  }

  /// Parts are ranges of elements: where each ends. Their texts begin with the id.
  void read_parts(std::uint64_t parts, Section& section) {
    const auto ends = words_.integers(parts);
    const auto texts = words_.texts(parts, part_bytes);
    section.parts.assign(section.elements, 0);
    std::size_t element = 0;
    for (std::size_t p = 0; p < ends.size(); ++p) {
      if (ends[p] > section.elements || ends[p] < element) words_.fail("the ranges of parts do not fit the elements");
      std::uint32_t id = 0;
      const std::string_view digits = std::string_view(texts[p]).substr(0, texts[p].find_first_not_of("0123456789"));
      if (!text::parse_integer(digits, id)) words_.fail("part " + text::quoted(texts[p]) + " has no id");
      for (; element < ends[p]; ++element) section.parts[element] = id;
    }
  }

  void read_scalars(const std::vector<std::string>& names, Section& section) {
    for (const std::string& name : names)
      section.scalars.push_back({with_underscores(name), 1, words_.reals(section.elements)});
  }

  void add_cells(const Section& section, std::size_t corners, CellKind kind) {
    for (std::size_t e = 0; e < section.elements; ++e)
      grid_.cells.add(kind, std::span(section.nodes).subspan(e * corners, corners));
  }

  /// Under the names that the solver's converter to VTK gives them.
  void add_arrays(const Section& shells, const Section& solids) {
    const auto add = [&](const std::string& name, auto first, const auto& second) {
      std::vector<double> values(first.begin(), first.end());
      values.insert(values.end(), second.begin(), second.end());
      grid_.cell_arrays.push_back({name, 1, std::move(values)});
    };
    if (has_ids_) add("ELEMENT_ID", shells.ids, solids.ids);
    add("PART_ID", shells.parts, solids.parts);
    add("EROSION_STATUS", shells.alive, solids.alive);
    for (const Array& array : shells.scalars)
      add("2DELEM_" + array.name, array.values, std::vector<double>(solids.elements));
    for (const Array& array : solids.scalars)
      add("3DELEM_" + array.name, std::vector<double>(shells.elements), array.values);
  }

  static std::string with_underscores(std::string name) {
    std::replace(name.begin(), name.end(), ' ', '_');
    return name;
  }

  Words words_;
  Grid grid_;
  bool has_masses_ = false, has_ids_ = false, has_hierarchy_ = false;
};
}  // namespace

bool is_radioss_animation(std::string_view start) noexcept {
  return start.starts_with(animation_mark) && start.size() >= animation_head_bytes;
}

/// Shells and solids with their ids, parts, flags of eroded elements and scalars. Beams and particles are skipped.
Grid parse_radioss_animation(std::string_view bytes, const std::string& name) {
  return AnimationParser(bytes, name).parse(false);
}

/// A grid that has only its time.
Grid read_radioss_time(const std::filesystem::path& file) {
  const InputFile input(file);
  std::array<std::byte, 8> start{};
  if (input.size() >= start.size()) input.read(0, start);
  return AnimationParser(as_text(std::span(start)), input.name()).parse(true);
}
}  // namespace lbea::io::grid
