#include "adapters/simulation/vtk/vtk.hpp"

#include "adapters/files/atomic_file.hpp"
#include "adapters/files/binary_numbers.hpp"
#include "adapters/files/text_line.hpp"

#include <lbea/lbea.hpp>

#include <algorithm>
#include <fstream>

namespace lbea::io::grid {
namespace {
constexpr std::string_view mark = "# vtk DataFile Version";
constexpr std::size_t head_bytes = 1 << 16;

std::string decoded(std::string_view name) {  // blanks in names are written as %20
  std::string result;
  for (std::size_t i = 0; i < name.size(); ++i) {
    unsigned code = 0;
    if (name[i] == '%' && i + 2 < name.size() &&
        std::from_chars(name.data() + i + 1, name.data() + i + 3, code, 16).ptr == name.data() + i + 3) {
      result += static_cast<char>(code);
      i += 2;
    } else {
      result += name[i];
    }
  }
  return result;
}

using binary::Scalar;

constexpr std::array<std::pair<std::string_view, Scalar>, 14> types{{
    {"unsigned_char", Scalar::uint8},
    {"char", Scalar::int8},
    {"signed_char", Scalar::int8},
    {"unsigned_short", Scalar::uint16},
    {"short", Scalar::int16},
    {"unsigned_int", Scalar::uint32},
    {"int", Scalar::int32},
    {"unsigned_long", Scalar::uint64},
    {"long", Scalar::int64},
    {"vtktypeint64", Scalar::int64},
    {"vtktypeuint64", Scalar::uint64},
    {"vtkidtype", Scalar::int32},
    {"float", Scalar::float32},
    {"double", Scalar::float64},
}};

/// Lines and values of the file: text, or binary and big-endian.
class VtkTokens {
 public:
  VtkTokens(std::string_view bytes, const std::string& name) : bytes_(bytes), name_(name) {}

  bool is_binary = false;

  /// The next line; false at the end.
  bool line(std::string_view& line) noexcept {
    if (at_ >= bytes_.size()) return false;
    const std::size_t end = std::min(bytes_.find('\n', at_), bytes_.size());
    line = bytes_.substr(at_, end - at_);
    if (line.ends_with('\r')) line.remove_suffix(1);
    at_ = std::min(end + 1, bytes_.size());
    return true;
  }
  /// The next line that is not blank, without moving past it; empty at the end.
  [[nodiscard]] std::string_view peek() noexcept {
    skip_blank_lines();
    const std::size_t before = at_;
    std::string_view next;
    line(next);
    at_ = before;
    return next;
  }
  /// `count` values of a type as VTK calls it ("float", "vtktypeint64", ...).
  [[nodiscard]] std::vector<double> values(std::uint64_t count, std::string_view type) {
    const std::string wanted = text::lower(type);
    const auto found =
        std::find_if(types.begin(), types.end(), [&](const auto& known) { return known.first == wanted; });
    if (found == types.end())
      fail("values of type \"" + std::string(type) + "\" are not read; export them as float", true);
    if (!is_binary) return text_values(count);
    const std::size_t size = binary::size_of(found->second);
    if (binary::times(count, size) > bytes_.size() - at_)
      fail("the file ends within " + std::to_string(count) + " values; it is cut short");
    std::vector<double> values(count);
    for (double& value : values) {
      value = binary::load(reinterpret_cast<const std::byte*>(bytes_.data() + at_), found->second, true);
      at_ += size;
    }
    return values;
  }

  /// The same for indices and counts.
  [[nodiscard]] std::vector<std::uint64_t> indices(std::uint64_t count, std::string_view type) {
    std::vector<std::uint64_t> result;
    result.reserve(std::min<std::uint64_t>(count, bytes_.size()));
    for (const double value : values(count, type)) {
      if (!(value >= 0 && value < 4294967295.0)) fail("an index is negative or too large");
      result.push_back(static_cast<std::uint64_t>(value));
    }
    return result;
  }
  void skip_blank_lines() noexcept {
    while (at_ < bytes_.size() && text::is_space(bytes_[at_])) ++at_;
  }
  [[noreturn]] void fail(const std::string& what, bool is_unsupported = false) const {
    throw Error{is_unsupported ? Status::unsupported_input : Status::bad_input,
                name_ + ", byte " + std::to_string(at_) + ": " + what + " (VTK legacy file)"};
  }

 private:
  [[nodiscard]] std::vector<double> text_values(std::uint64_t count) {
    if (count > (bytes_.size() - at_) / 2 + 1)
      fail("too few values follow, " + std::to_string(count) + " were declared");
    std::vector<double> values(count);
    for (double& value : values) {
      skip_blank_lines();
      std::string_view rest = bytes_.substr(at_);
      if (!text::next_real(rest, value) || (!rest.empty() && !text::is_space(rest.front()))) fail("expected a number");
      at_ = bytes_.size() - rest.size();
    }
    return values;
  }

  std::string_view bytes_;
  const std::string& name_;
  std::size_t at_ = 0;
};

class LegacyParser {
 public:
  LegacyParser(std::string_view bytes, const std::string& name) : tokens_(bytes, name) {}

  /// `only_time`: stops at the points.
  Grid parse(bool only_time) {
    read_head();
    for (;;) {
      tokens_.skip_blank_lines();
      std::string_view rest;
      if (!tokens_.line(rest)) break;
      const std::string_view keyword = text::next_word(rest);
      if (only_time && keyword == "POINTS") return std::move(grid_);
      section(keyword, rest);
    }
    for (const auto& cells : pieces_)
      for (std::size_t c = 0; c < cells.size(); ++c) grid_.cells.add(cells.kinds[c], cells[c]);
    if (grid_.cells.size() != kinds_.size() && !is_polygons_) tokens_.fail("as many CELL_TYPES as CELLS are needed");
    for (std::size_t c = 0; c < kinds_.size() && !is_polygons_; ++c) grid_.cells.kinds[c] = kinds_[c];
    return std::move(grid_);
  }

 private:
  void read_head() {
    std::string_view line;
    if (!tokens_.line(line) || !line.starts_with(mark))
      tokens_.fail("the first line is not \"" + std::string(mark) + "\"");
    tokens_.line(line);  // title
    const std::string_view encoding = text::trimmed(tokens_.peek());
    tokens_.line(line);
    if (encoding != "ASCII" && encoding != "BINARY") tokens_.fail("the third line is neither ASCII nor BINARY");
    tokens_.is_binary = encoding == "BINARY";
    std::string_view kind = tokens_.peek();
    tokens_.line(line);
    if (text::next_word(kind) != "DATASET") tokens_.fail("the fourth line does not say which DATASET it is");
    const std::string name(text::trimmed(kind));
    is_polygons_ = name == "POLYDATA";
    if (!is_polygons_ && name != "UNSTRUCTURED_GRID")
      tokens_.fail("DATASET " + name + " is not read; export an UNSTRUCTURED_GRID or POLYDATA", true);
  }

  void section(std::string_view keyword, std::string_view rest) {
    if (keyword == "FIELD") return read_fields(rest);
    if (keyword == "METADATA") return skip_metadata();
    if (keyword == "POINTS") return read_points(rest);
    if (keyword == "CELLS") return read_cells(rest, 0, CellKind::polygon);
    if (keyword == "VERTICES") return read_cells(rest, 0, CellKind::poly_vertex);
    if (keyword == "LINES") return read_cells(rest, 1, CellKind::poly_line);
    if (keyword == "POLYGONS") return read_cells(rest, 2, CellKind::polygon);
    if (keyword == "TRIANGLE_STRIPS") return read_cells(rest, 3, CellKind::triangle_strip);
    if (keyword == "CELL_TYPES") return read_kinds(rest);
    if (keyword == "POINT_DATA" || keyword == "CELL_DATA") {
      arrays_ = keyword == "POINT_DATA" ? &grid_.point_arrays : &grid_.cell_arrays;
      rows_ = count(rest);
      return;
    }
    read_attribute(keyword, rest);
  }

  void read_attribute(std::string_view keyword, std::string_view rest) {
    const std::string name = decoded(text::next_word(rest));
    if (keyword == "SCALARS") return read_scalars(name, rest);
    if (keyword == "VECTORS" || keyword == "NORMALS") return add_array(name, 3, text::next_word(rest));
    if (keyword == "TENSORS") return add_array(name, 9, text::next_word(rest));
    if (keyword == "TENSORS6") return add_array(name, 6, text::next_word(rest));
    if (keyword == "GLOBAL_IDS" || keyword == "PEDIGREE_IDS" || keyword == "EDGE_FLAGS")
      return add_array(name, 1, text::next_word(rest));
    if (keyword == "COLOR_SCALARS") return add_array(name, count(rest), tokens_.is_binary ? "unsigned_char" : "float");
    if (keyword == "TEXTURE_COORDINATES") {
      const std::uint64_t dimensions = count(rest);
      return add_array(name, dimensions, text::next_word(rest));
    }
    if (keyword == "LOOKUP_TABLE") {
      static_cast<void>(tokens_.values(binary::times(count(rest), 4), tokens_.is_binary ? "unsigned_char" : "float"));
      return;
    }
    tokens_.fail("unknown keyword \"" + std::string(keyword.substr(0, 40)) + "\"");
  }

  void read_scalars(const std::string& name, std::string_view rest) {
    const std::string_view type = text::next_word(rest);
    const std::uint64_t components = text::trimmed(rest).empty() ? 1 : count(rest);
    std::string_view table;
    if (tokens_.peek().starts_with("LOOKUP_TABLE")) tokens_.line(table);
    add_array(name, components, type);
  }

  void add_array(const std::string& name, std::uint64_t components, std::string_view type) {
    if (arrays_ == nullptr) tokens_.fail("an attribute before POINT_DATA or CELL_DATA");
    if (components == 0) tokens_.fail("an array without components");
    arrays_->push_back({name, components, tokens_.values(binary::times(rows_, components), type)});
  }

  void read_fields(std::string_view rest) {
    text::next_word(rest);  // "FieldData"
    for (std::uint64_t arrays = count(rest); arrays > 0; --arrays) {
      if (tokens_.peek().starts_with("METADATA")) skip_metadata();
      std::string_view line = tokens_.peek();
      if (line.empty()) tokens_.fail("the file ends before the last array of a FIELD; it is cut short");
      tokens_.line(line);
      const std::string name = decoded(text::next_word(line));
      const std::uint64_t components = count(line), rows = count(line);
      const std::string_view type = text::next_word(line);
      if ((type == "string" || type == "variant") && !tokens_.is_binary) {
        for (std::uint64_t row = 0; row < binary::times(components, rows) && tokens_.line(line); ++row) {}
        continue;
      }
      Array array{name, components, tokens_.values(binary::times(components, rows), type)};
      if (arrays_ != nullptr) {
        if (components > 0 && rows == rows_) arrays_->push_back(std::move(array));
      } else if (array.values.size() == 1 && (name == "TIME" || name == "TimeValue" || name == "Time")) {
        grid_.time = array.values.front();
      }
    }
  }

  /// Up to a blank line.
  void skip_metadata() {
    std::string_view line;
    while (tokens_.line(line) && !text::trimmed(line).empty()) {}
  }

  void read_points(std::string_view rest) {
    const std::uint64_t points = count(rest);
    const auto values = tokens_.values(binary::times(points, 3), text::next_word(rest));
    grid_.positions.assign(values.begin(), values.end());
  }

  void read_cells(std::string_view rest, std::size_t piece, CellKind kind) {
    const std::uint64_t cells = count(rest), size = count(rest);
    if (tokens_.peek().starts_with("OFFSETS")) return read_offsets(cells, size, piece, kind);
    const auto list = tokens_.indices(size, "int");
    std::size_t at = 0;
    std::vector<std::uint32_t> corners;
    for (std::uint64_t c = 0; c < cells; ++c) {
      if (at >= list.size() || list[at] > list.size() - at - 1) tokens_.fail("cells run past the end of their list");
      const auto first = list.begin() + static_cast<std::ptrdiff_t>(at) + 1;
      corners.assign(first, first + static_cast<std::ptrdiff_t>(list[at]));
      pieces_[piece].add(kind, corners);
      at += list[at] + 1;
    }
  }

  void read_offsets(std::uint64_t offsets, std::uint64_t size, std::size_t piece, CellKind kind) {
    const auto block = [&](std::string_view keyword, std::uint64_t values) {
      std::string_view line = tokens_.peek();
      tokens_.line(line);
      if (text::next_word(line) != keyword) tokens_.fail("expected " + std::string(keyword));
      return tokens_.indices(values, text::next_word(line));
    };
    const auto ends = block("OFFSETS", offsets);
    const auto list = block("CONNECTIVITY", size);
    std::vector<std::uint32_t> corners;
    for (std::size_t c = 0; c + 1 < ends.size(); ++c) {
      if (ends[c] > ends[c + 1] || ends[c + 1] > list.size()) tokens_.fail("offsets of cells decrease");
      const auto at = [&](std::uint64_t i) { return list.begin() + static_cast<std::ptrdiff_t>(i); };
      corners.assign(at(ends[c]), at(ends[c + 1]));
      pieces_[piece].add(kind, corners);
    }
  }

  void read_kinds(std::string_view rest) {
    for (const std::uint64_t kind : tokens_.indices(count(rest), "int")) {
      if (kind > 255) tokens_.fail("a cell type is too large");
      kinds_.push_back(static_cast<CellKind>(kind));
    }
  }

  std::uint64_t count(std::string_view& rest) const {
    std::uint64_t value = 0;
    if (!text::parse_integer(text::next_word(rest), value) || value > 0xffffffffu) tokens_.fail("expected a count");
    return value;
  }

  VtkTokens tokens_;
  Grid grid_;
  bool is_polygons_ = false;
  std::array<Cells, 4> pieces_;  // cells of polygons, numbered in this order: vertices, lines, polygons, strips
  std::vector<CellKind> kinds_;
  std::vector<Array>* arrays_ = nullptr;
  std::uint64_t rows_ = 0;
};
}  // namespace

bool is_vtk_legacy(std::string_view start) noexcept { return start.starts_with(mark); }

Grid parse_vtk_legacy(std::string_view bytes, const std::string& name) {
  return LegacyParser(bytes, name).parse(false);
}

Grid read_vtk_legacy_time(const std::filesystem::path& file) {
  std::string head(head_bytes, '\0');
  std::ifstream in(file, std::ios::binary);
  in.read(head.data(), static_cast<std::streamsize>(head.size()));
  head.resize(static_cast<std::size_t>(in.gcount()));
  try {
    return LegacyParser(head, file.string()).parse(true);
  } catch (const Error&) {
    // Either the file is damaged, which the error of the whole file says, or its points begin behind the first bytes.
    return parse_vtk_legacy(as_text(read_file(file)), file.string());
  }
}
}  // namespace lbea::io::grid
