#include "adapters/simulation/d3plot/database.hpp"

#include <algorithm>

#include "adapters/simulation/d3plot/words.hpp"

namespace lbea::io::d3plot {
namespace {
// Positions of the control words.
enum Word : std::uint64_t {};
constexpr Word file_type{file_type_word}, ndim{dimensions_word}, numnp{16}, nglbv{18}, it{19}, iu{20}, iv{21}, ia{22},
    nel8{23}, nummat8{24}, numds{25}, nv3d{27}, nel2{28}, nummat2{29}, nv1d{30}, nel4{31}, nummat4{32}, nv2d{33},
    neiph{34}, neips{35}, maxint{36}, nmsph{37}, narbs{39}, nelt{40}, nummatt{41}, nv3dt{42}, ioshl1{43}, ioshl2{44},
    ioshl3{45}, ioshl4{46}, ialemat{47}, ncfdv1{48}, ncfdv2{49}, nadapt{50}, nmmat{51}, npefg{54}, nel48{55}, idtdt{56},
    extra{57}, nel20{64}, nt3d{65}, nel27{66}, nel21p{68}, nel15t{69}, nel20t{71}, nel40p{72}, nel64{73}, quadr{74},
    cubic{75}, penout{78}, engout{79};
constexpr std::uint64_t known_words = 80;
constexpr std::uint64_t version_word = 14;  // a real

constexpr std::int64_t femzip_mark = 76'893'465;     // in NMMAT
constexpr std::int64_t deletion_offset = 10'000;     // added to |MAXINT| when there is a deletion word per element
constexpr std::int64_t largest_row = 1'000'000'000;  // words per element or global values; beyond is damage

class ControlWords {
 public:
  explicit ControlWords(const WordFile& file)
      : file_(file), values_(file.integers(0, base_words, "the control words")) {
    const std::uint64_t more = count(extra, file.words(), "EXTRA");
    size_ = base_words + more;
    const std::uint64_t known = std::min(size_, known_words) - base_words;
    const auto rest = file.integers(base_words, known, "the extra control words");
    values_.insert(values_.end(), rest.begin(), rest.end());
    values_.resize(known_words);
  }

  std::uint64_t size() const { return size_; }
  std::int64_t operator[](Word word) const { return values_[word]; }
  bool has(Word word) const { return values_[word] != 0; }
  std::int64_t digit(Word word, std::int64_t place) const { return values_[word] / place % 10; }

  /// A number of things that take at least a word each in this file.
  std::uint64_t stored(Word word, const char* name) const { return count(word, file_.words(), name); }
  /// A number of values per element or state.
  std::uint64_t row(Word word, const char* name) const {
    return count(word, static_cast<std::uint64_t>(largest_row), name);
  }

  void refuse_when(bool condition, Word word, const char* sentence) const {
    if (condition) file_.refuse(Status::unsupported_input, word, sentence);
  }

 private:
  std::uint64_t count(Word word, std::uint64_t most, const char* name) const {
    const std::int64_t value = values_[word];
    if (value < 0 || static_cast<std::uint64_t>(value) > most)
      file_.refuse(Status::bad_input, word,
                   std::string("the control word ") + name + " is " + std::to_string(value) +
                       ", which this file cannot hold; the file is damaged or cut short, copy or compute it again");
    return static_cast<std::uint64_t>(value);
  }

  const WordFile& file_;
  std::uint64_t size_ = base_words;
  std::vector<std::int64_t> values_;
};

void refuse_unsupported(const ControlWords& words, std::uint64_t word_bytes) {
  words.refuse_when(words[nmmat] == femzip_mark, nmmat,
                    "the database is FEMZIP-compressed; decompress it with FEMZIP first");
  words.refuse_when(words[file_type] % wide_ids == type_d3eigv, file_type,
                    "the file holds eigenvectors (d3eigv); give the d3plot of a run over time");
  words.refuse_when(words[file_type] >= wide_ids && word_bytes == 4, file_type,
                    "8-byte ids in a 4-byte database are not read; write the database in double precision");
  words.refuse_when(words[ndim] == 2, ndim, "the model is two-dimensional; a three-dimensional run is needed");
  words.refuse_when(words[ndim] == 6 || words[ndim] > 7, ndim,
                    "rigid-body motion or road output (NDIM 6, 8, 9) is not read; write the run without it");
  words.refuse_when(words.has(nmsph) || words.has(npefg), words.has(nmsph) ? nmsph : npefg,
                    "particles (SPH, airbag) are not read; write the component alone, with *DATABASE_EXTENT_D3PART");
  words.refuse_when(words.has(ncfdv1) || words.has(ncfdv2), words.has(ncfdv1) ? ncfdv1 : ncfdv2,
                    "fluid or multi-solver results are not read; write the structure's results alone");
  words.refuse_when(words.has(nadapt), nadapt, "the mesh is adaptive; run without *CONTROL_ADAPTIVE");
  words.refuse_when(words[nel8] < 0, nel8,
                    "ten-node tetrahedra are not read; write four nodes with *CONTROL_OUTPUT TET10S8=2");
  words.refuse_when(words.has(penout) || words.has(engout), words.has(penout) ? penout : engout,
                    "contact penetration or contact energy per node is not read; write the run without it");
}

std::uint64_t node_words(const ControlWords& words) {
  const std::int64_t temperature = words.digit(it, 1);
  std::uint64_t per_node = 0;
  if (temperature == 1 || temperature == 2) per_node += 1;
  if (temperature == 3) per_node += 3;                      // inner, middle, outer
  if (temperature == 2 || temperature == 3) per_node += 3;  // flux
  if (words.digit(it, 10) == 1) per_node += 1;              // mass scaling
  if (words.digit(idtdt, 1) == 1) per_node += 1;            // temperature rate
  if (words.digit(idtdt, 10) == 1) per_node += 6;           // residual forces and moments
  for (const Word vector : {iu, iv, ia})
    if (words.has(vector)) per_node += 3;
  return per_node;
}

std::uint64_t extra_node_words(const ControlWords& words) {
  const auto block = [&](Word word, const char* name, std::uint64_t per_element, bool is_written) {
    return is_written ? times(words.stored(word, name), per_element) : 0;
  };
  const bool is_quadratic = words.has(quadr), is_cubic = words.has(cubic);
  std::uint64_t sum = block(nel48, "NEL48", 5, true);
  sum = plus(sum, block(nel20, "NEL20", 13, true));
  sum = plus(sum, block(nel27, "NEL27", 28, is_quadratic));
  sum = plus(sum, block(nel21p, "NEL21P", 22, is_quadratic));
  sum = plus(sum, block(nel15t, "NEL15T", 8, is_quadratic));
  sum = plus(sum, block(nel20t, "NEL20T", 21, is_cubic));
  sum = plus(sum, block(nel40p, "NEL40P", 41, is_cubic));
  return plus(sum, block(nel64, "NEL64", 65, is_cubic));
}

/// 0: not known.
std::uint64_t materials(const ControlWords& words) {
  std::uint64_t sum = 0;
  for (const Word kind : {nummat8, nummat2, nummat4, nummatt}) {
    if (words[kind] < 0) return 0;
    sum = plus(sum, static_cast<std::uint64_t>(words[kind]));
  }
  return sum;
}

void read_counts(const ControlWords& words, Header& header) {
  header.control_words = words.size();
  header.nodes = words.stored(numnp, "NUMNP");
  header.solids = words.stored(nel8, "NEL8");
  header.thick_shells = words.stored(nelt, "NELT");
  header.beams = words.stored(nel2, "NEL2");
  header.shells = words.stored(nel4, "NEL4");
  header.parts = words.stored(nmmat, "NMMAT");
  header.materials = materials(words);
  header.fluid_materials = words.stored(ialemat, "IALEMAT");
  header.numbering_words = words.stored(narbs, "NARBS");
  header.extra_node_words = extra_node_words(words);
}

void read_rows(const ControlWords& words, Header& header) {
  header.globals = words.row(nglbv, "NGLBV");
  header.has_positions = words.has(iu);
  header.node_words = node_words(words);
  header.solid_thermal_words = words.row(nt3d, "NT3D");
  header.solid_words = words.row(nv3d, "NV3D");
  header.thick_shell_words = words.row(nv3dt, "NV3DT");
  header.beam_words = words.row(nv1d, "NV1D");
  header.shell_words = words.row(nv2d, "NV2D");
  header.solid_history = words.row(neiph, "NEIPH");
  header.shell_history = words.row(neips, "NEIPS");
}

void read_layers(const ControlWords& words, Header& header) {
  const std::int64_t value = words[maxint];
  // INT64_MIN has no absolute value
  const auto magnitude =
      value < 0 ? std::uint64_t{0} - static_cast<std::uint64_t>(value) : static_cast<std::uint64_t>(value);
  const auto offset = static_cast<std::uint64_t>(deletion_offset);
  if (magnitude > offset || value == -deletion_offset)
    header.deletion = Deletion::elements;
  else if (value < 0)
    header.deletion = Deletion::nodes;
  header.shell_points = header.deletion == Deletion::elements ? magnitude - offset : magnitude;
}

// 1000: shells and solids store it; 999: solids only; 0: neither
void read_output_flags(const ControlWords& words, Header& header) {
  const auto shells_have = [&](Word word) { return words[word] == 1000; };
  const auto solids_have = [&](Word word) { return words[word] == 1000 || words[word] == 999; };
  header.has_shell_stress = shells_have(ioshl1);
  header.has_shell_plastic_strain = shells_have(ioshl2);
  header.has_shell_forces = shells_have(ioshl3);
  header.has_shell_extra = shells_have(ioshl4);
  header.has_solid_stress = solids_have(ioshl1);
  header.has_solid_plastic_strain = solids_have(ioshl2);
}

std::uint64_t shell_words_without_strain(const Header& header) {
  const std::uint64_t point =
      (header.has_shell_stress ? 6u : 0u) + (header.has_shell_plastic_strain ? 1u : 0u) + header.shell_history;
  return plus(times(header.shell_points, point),
              (header.has_shell_forces ? 8u : 0u) + (header.has_shell_extra ? 4u : 0u));
}

// Older databases do not say whether strains are stored; the length of a shell's row shows it.
bool stores_strain(const ControlWords& words, const Header& header) {
  if (words[idtdt] > 100) return words.digit(idtdt, 10'000) == 1;
  return header.shell_words > plus(shell_words_without_strain(header), 1);
}
}  // namespace

Header read_header(WordFile& file) {
  const std::optional<Encoding> encoding = detect_encoding(file);
  if (!encoding)
    file.refuse(Status::unsupported_input, 0,
                "this is not the first file of an LS-DYNA d3plot database (or it is compressed); give the file with "
                "the control words, usually named d3plot");
  if (encoding->is_big_endian)
    file.refuse(Status::unsupported_input, 0, "the database is big-endian; convert it to little-endian words first");
  file.set_word_bytes(encoding->word_bytes);
  const ControlWords words(file);
  refuse_unsupported(words, file.word_bytes());
  Header header;
  header.version = file.real(version_word, "the version");
  header.stores_rigid_shells = words[file_type] % wide_ids == type_d3part;
  header.has_material_types = words[ndim] == 5 || words[ndim] == 7;
  header.has_road = words[ndim] == 7;
  read_counts(words, header);
  read_rows(words, header);
  read_layers(words, header);
  read_output_flags(words, header);
  // four in-plane points per layer
  if (words[numds] < 0) {
    Header with_points = header;
    with_points.shell_points = times(header.shell_points, 4);
    if (header.shell_words >= shell_words_without_strain(with_points)) header.shell_points = with_points.shell_points;
  }
  header.has_strain = stores_strain(words, header);
  return header;
}
}  // namespace lbea::io::d3plot
