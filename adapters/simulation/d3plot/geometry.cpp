#include "adapters/simulation/d3plot/database.hpp"

#include <algorithm>
#include <numeric>

namespace lbea::io::d3plot {
namespace {
constexpr std::uint64_t short_header = 10;
constexpr std::uint64_t long_header = 16;  // NSORT < 0: part ids follow those of the elements

std::vector<std::uint32_t> count_from_one(std::size_t size) {
  std::vector<std::uint32_t> ids(size);
  std::iota(ids.begin(), ids.end(), 1u);
  return ids;
}

std::vector<std::uint32_t> read_ids(const WordFile& file, std::uint64_t word, std::uint64_t count,
                                    const std::string& what) {
  const auto words = file.integers(word, count, what);
  std::vector<std::uint32_t> ids(words.size());
  for (std::size_t i = 0; i < ids.size(); ++i) {
    if (words[i] < 0 || words[i] > std::numeric_limits<std::uint32_t>::max())
      file.refuse_damaged(word + i, what + " contain " + std::to_string(words[i]) + ", which is not an id");
    ids[i] = static_cast<std::uint32_t>(words[i]);
  }
  return ids;
}

/// Lengths of the five lists, in the order of the block.
struct Lists {
  std::uint64_t nodes, solids, beams, shells, thick_shells;

  [[nodiscard]] std::uint64_t sum() const { return plus(plus(plus(nodes, solids), plus(beams, shells)), thick_shells); }
};

Lists read_lengths(const WordFile& file, std::uint64_t word, const std::vector<std::int64_t>& header_words,
                   const Header& header) {
  const auto length = [&](std::size_t at, std::uint64_t expected, const char* what) {
    const std::int64_t value = header_words[at];
    if (value != 0 && (value < 0 || static_cast<std::uint64_t>(value) != expected))
      file.refuse_damaged(word + at, "the numbering block lists " + std::to_string(value) + " " + what +
                                         ", the database has " + std::to_string(expected));
    return static_cast<std::uint64_t>(value);
  };
  return {length(5, header.nodes, "nodes"), length(6, header.solids, "solids"), length(7, header.beams, "beams"),
          length(8, header.shells, "shells"), length(9, header.thick_shells, "thick shells")};
}

constexpr std::int64_t rigid_material = 20;

/// Fills the ids of `geometry` from the numbering block (NARBS) at `word`; counts from 1 where the file has none.
void read_numbering(const WordFile& file, std::uint64_t word, const Header& header, Geometry& geometry) {
  geometry.node_ids = count_from_one(header.nodes);
  geometry.solids.ids = count_from_one(header.solids);
  std::vector<std::uint32_t> thick_shell_ids = count_from_one(header.thick_shells);
  geometry.shells.ids = count_from_one(header.shells);
  const auto append_thick_shells = [&] {
    geometry.solids.ids.insert(geometry.solids.ids.end(), thick_shell_ids.begin(), thick_shell_ids.end());
  };
  if (header.numbering_words == 0) return append_thick_shells();

  file.require(word, header.numbering_words, "the numbering block");
  const auto header_words = file.integers(word, short_header, "the numbering block");
  const bool has_part_ids = header_words[0] < 0;
  const Lists lists = read_lengths(file, word, header_words, header);
  const std::uint64_t start = has_part_ids ? long_header : short_header;
  const std::uint64_t needed = plus(plus(start, lists.sum()), has_part_ids ? header.parts : 0);
  if (needed > header.numbering_words)
    file.refuse_damaged(word, "the numbering block has " + std::to_string(header.numbering_words) +
                                  " words, its lists need " + std::to_string(needed));

  std::uint64_t at = word + start;
  if (lists.nodes > 0) geometry.node_ids = read_ids(file, at, lists.nodes, "node ids");
  at += lists.nodes;
  if (lists.solids > 0) geometry.solids.ids = read_ids(file, at, lists.solids, "solid ids");
  at += lists.solids + lists.beams;
  if (lists.shells > 0) geometry.shells.ids = read_ids(file, at, lists.shells, "shell ids");
  at += lists.shells;
  if (lists.thick_shells > 0) thick_shell_ids = read_ids(file, at, lists.thick_shells, "thick shell ids");
  at += lists.thick_shells;
  append_thick_shells();
  if (has_part_ids) geometry.part_ids = read_ids(file, at, header.parts, "part ids");
}

/// Reads one block after the other.
class Cursor {
 public:
  Cursor(const WordFile& file, std::uint64_t word) : file_(file), word_(word) {}
  std::uint64_t word() const { return word_; }
  void skip(std::uint64_t words) { word_ = plus(word_, words); }
  std::vector<std::int64_t> integers(std::uint64_t count, const std::string& what) {
    auto values = file_.integers(word_, count, what);
    skip(count);
    return values;
  }
  /// A word that is the length of a list.
  std::uint64_t count(const std::string& what) {
    const std::int64_t value = integers(1, what).front();
    if (value < 0 || static_cast<std::uint64_t>(value) > file_.words())
      file_.refuse_damaged(word_ - 1, what + " is " + std::to_string(value));
    return static_cast<std::uint64_t>(value);
  }

 private:
  const WordFile& file_;
  std::uint64_t word_;
};

// MATTYP: the material type of every part, 20 for rigid.
std::vector<std::int64_t> read_material_types(Cursor& cursor, Geometry& geometry) {
  geometry.rigid_shells = cursor.count("the number of rigid shells (NUMRBE)");
  const std::uint64_t materials = cursor.count("the number of material types (NUMMAT)");
  return cursor.integers(materials, "the list of material types");
}

template <std::size_t Corners>
Elements<Corners> read_elements(const WordFile& file, Cursor& cursor, std::uint64_t count, std::uint64_t nodes,
                                const std::string& what) {
  const std::uint64_t start = cursor.word();
  const auto words = cursor.integers(times(count, Corners + 1), "the connectivity of " + what);
  Elements<Corners> elements;
  elements.nodes.resize(count);
  elements.parts.resize(count);
  const auto checked = [&](std::size_t at, std::uint64_t most, const char* name) {
    if (words[at] < 1 || static_cast<std::uint64_t>(words[at]) > most)
      file.refuse_damaged(start + at,
                          what + " refer to " + name + " " + std::to_string(words[at]) + ", which does not exist");
    return static_cast<std::uint32_t>(words[at]);
  };
  for (std::size_t e = 0; e < count; ++e) {
    for (std::size_t c = 0; c < Corners; ++c) elements.nodes[e][c] = checked(e * (Corners + 1) + c, nodes, "node") - 1;
    elements.parts[e] = checked(e * (Corners + 1) + Corners, std::numeric_limits<std::uint32_t>::max(), "part");
  }
  return elements;
}

void append(Elements<8>& elements, const Elements<8>& more) {
  elements.nodes.insert(elements.nodes.end(), more.nodes.begin(), more.nodes.end());
  elements.parts.insert(elements.parts.end(), more.parts.begin(), more.parts.end());
}

void mark_rigid_shells(const WordFile& file, const Header& header, const std::vector<std::int64_t>& material_types,
                       Geometry& geometry) {
  geometry.shell_is_rigid.assign(geometry.shells.size(), 0);
  if (geometry.rigid_shells == 0) return;
  std::uint64_t rigid = 0;
  for (std::size_t e = 0; e < geometry.shells.size(); ++e) {
    const std::uint32_t part = geometry.shells.parts[e];
    const bool is_rigid = part <= material_types.size() && material_types[part - 1] == rigid_material;
    geometry.shell_is_rigid[e] = is_rigid ? 1 : 0;
    rigid += is_rigid ? 1 : 0;
  }
  if (rigid != geometry.rigid_shells)
    file.refuse_damaged(header.control_words, std::to_string(geometry.rigid_shells) +
                                                  " rigid shells are declared, but " + std::to_string(rigid) +
                                                  " have a rigid material");
}

// Road surface: node ids and positions, then per surface its id and segments of four nodes.
void skip_road(Cursor& cursor, Geometry& geometry) {
  const std::uint64_t nodes = cursor.count("the number of road nodes");
  cursor.skip(1);  // segments in total
  const std::uint64_t surfaces = cursor.count("the number of road surfaces");
  const bool is_moving = cursor.integers(1, "the motion flag of the road").front() != 0;
  cursor.skip(times(nodes, 4));
  for (std::uint64_t s = 0; s < surfaces; ++s) {
    cursor.skip(1);
    cursor.skip(times(cursor.count("the number of road segments"), 4));
  }
  geometry.moving_roads = is_moving ? surfaces : 0;
}

// Titles of the run, parts and contacts, and the keyword lines of d3prop, follow an end marker. Their texts have fixed
// lengths in bytes for both word sizes.
std::uint64_t skip_titles(const WordFile& file, std::uint64_t word) {
  const std::uint64_t title = 72 / file.word_bytes(), line = 80 / file.word_bytes();
  const auto is_marker = [&] { return word < file.words() && file.real(word, "the end marker") == end_marker; };
  if (!is_marker()) return word;
  ++word;
  while (plus(word, 2) <= file.words()) {
    const auto start = file.integers(word, 2, "a title");
    const auto entries = static_cast<std::uint64_t>(std::max<std::int64_t>(start[1], 0));
    std::uint64_t length = 0;
    if (start[0] == 90000)
      length = 1 + title;
    else if (start[0] == 90001 || start[0] == 90002 || start[0] == 90020)
      length = plus(2, times(entries, 1 + title));
    else if (start[0] == 90100 || start[0] == 900100)
      length = plus(2, times(entries, line));
    if (length == 0 || plus(word, length) > file.words()) break;
    word += length;
    if (is_marker()) ++word;
  }
  return word;
}
}  // namespace

Geometry read_geometry(const WordFile& file, const Header& header) {
  Geometry geometry;
  Cursor cursor(file, header.control_words);
  std::vector<std::int64_t> material_types;
  if (header.has_material_types) material_types = read_material_types(cursor, geometry);
  cursor.skip(header.fluid_materials);

  file.require(cursor.word(), times(header.nodes, 3), "the block of node positions");
  geometry.positions.resize(header.nodes * 3);
  file.reals(cursor.word(), geometry.positions, "the node positions");
  cursor.skip(header.nodes * 3);
  geometry.solids = read_elements<8>(file, cursor, header.solids, header.nodes, "solids");
  append(geometry.solids, read_elements<8>(file, cursor, header.thick_shells, header.nodes, "thick shells"));
  cursor.skip(times(header.beams, 6));
  geometry.shells = read_elements<4>(file, cursor, header.shells, header.nodes, "shells");
  mark_rigid_shells(file, header, material_types, geometry);

  read_numbering(file, cursor.word(), header, geometry);
  cursor.skip(header.numbering_words);
  if (header.has_road) skip_road(cursor, geometry);
  cursor.skip(header.extra_node_words);
  file.require(cursor.word(), 0, "the end of the geometry");
  geometry.end_word = skip_titles(file, cursor.word());
  return geometry;
}
}  // namespace lbea::io::d3plot
