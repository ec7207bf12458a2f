#include "adapters/files/atomic_file.hpp"
#include "adapters/files/text_line.hpp"
#include "adapters/simulation/vtk/vtk.hpp"
#include "adapters/simulation/vtk/xml_data.hpp"

#include <pugixml.hpp>

#include <algorithm>
#include <cmath>

namespace lbea::io::grid {
namespace {

constexpr std::string_view appended_tag = "<AppendedData";

constexpr std::string_view blanks = " \t\r\n";

class XmlParser {
 public:
  XmlParser(std::string_view bytes, const std::string& name) : name_(name) {
    load(bytes);
    file_ = document_.child("VTKFile");
    if (!file_) fail("has no element VTKFile");
    storage_.is_big_endian = attribute(file_, "byte_order") == "BigEndian";
    storage_.header_bytes = attribute(file_, "header_type") == "UInt64" ? 8 : 4;
    read_compressor();
  }

  Grid parse(bool only_time) {
    const std::string type(attribute(file_, "type"));
    if (type != "UnstructuredGrid" && type != "PolyData")
      fail("holds a " + type + "; export it as an unstructured grid (.vtu) or polygons (.vtp)" +
               (type.starts_with("P") ? ", and give the pieces' own files" : ""),
           Status::unsupported_input);
    const pugi::xml_node data = file_.child(type.c_str());
    if (!data) fail("has no element " + type);
    read_time(data);
    if (only_time) return std::move(grid_);
    for (const pugi::xml_node piece : data.children("Piece")) read_piece(piece, type == "PolyData");
    return std::move(grid_);
  }

 private:
  /// The data after the mark "_" are not XML, so only the part before them goes to the XML parser.
  void load(std::string_view bytes) {
    std::string xml(bytes.substr(0, std::min(bytes.find(appended_tag), bytes.size())));
    if (xml.size() < bytes.size()) {
      const std::string_view behind = bytes.substr(xml.size());
      const std::size_t tag = behind.find('>');
      const std::size_t underscore = behind.find('_', std::min(tag, behind.size()));
      if (tag == std::string_view::npos || underscore == std::string_view::npos) fail("ends within its appended data");
      storage_.is_appended_raw = behind.substr(0, tag).find("raw") != std::string_view::npos;
      storage_.appended = behind.substr(underscore + 1);
      xml += "</VTKFile>";
    }
    const pugi::xml_parse_result result = document_.load_buffer(xml.data(), xml.size());
    if (!result)
      throw Error{Status::bad_input, name_ + ", byte " + std::to_string(result.offset) + ": " + result.description() +
                                         " (XML); the file is damaged or cut short, export it again"};
  }

  void read_compressor() {
    const std::string compressor(attribute(file_, "compressor"));
    if (compressor.empty()) return;
    if (compressor == "vtkZLibDataCompressor")
      storage_.compressor = Compressor::zlib;
    else if (compressor == "vtkLZ4DataCompressor")
      storage_.compressor = Compressor::lz4;
    else
      fail("is compressed with " + compressor + "; export it with ZLib, LZ4 or without compression",
           Status::unsupported_input);
  }

  void read_time(const pugi::xml_node& data) {
    for (const pugi::xml_node array : data.child("FieldData").children("DataArray"))
      if (attribute(array, "Name") == "TimeValue") grid_.time = values(array, 1).front();
  }

  void read_piece(const pugi::xml_node& piece, bool is_polygons) {
    const std::size_t first_point = grid_.points();
    const std::uint64_t points = count(piece, "NumberOfPoints");
    const auto positions = values(piece.child("Points").child("DataArray"), points * 3);
    grid_.positions.insert(grid_.positions.end(), positions.begin(), positions.end());
    std::uint64_t cells = 0;
    if (is_polygons) {
      cells += read_cells(piece.child("Verts"), count(piece, "NumberOfVerts"), first_point, CellKind::poly_vertex);
      cells += read_cells(piece.child("Lines"), count(piece, "NumberOfLines"), first_point, CellKind::poly_line);
      cells += read_cells(piece.child("Polys"), count(piece, "NumberOfPolys"), first_point, CellKind::polygon);
      cells += read_cells(piece.child("Strips"), count(piece, "NumberOfStrips"), first_point, CellKind::triangle_strip);
    } else {
      cells = read_cells(piece.child("Cells"), count(piece, "NumberOfCells"), first_point, std::nullopt);
    }
    read_arrays(piece.child("PointData"), points, grid_.point_arrays);
    read_arrays(piece.child("CellData"), cells, grid_.cell_arrays);
  }

  std::uint64_t read_cells(const pugi::xml_node& node, std::uint64_t cells, std::size_t first_point,
                           std::optional<CellKind> kind) {
    if (cells == 0) return 0;
    const auto ends = indices(array_named(node, "offsets"), cells);
    const auto list = indices(array_named(node, "connectivity"), ends.back());
    const auto kinds = kind ? std::vector<std::uint64_t>() : indices(array_named(node, "types"), cells);
    std::vector<std::uint32_t> corners;
    for (std::size_t c = 0, begin = 0; c < cells; begin = ends[c++]) {
      if (ends[c] < begin || ends[c] > list.size()) fail("has decreasing offsets of cells");
      corners.clear();
      for (std::size_t i = begin; i < ends[c]; ++i)
        corners.push_back(static_cast<std::uint32_t>(list[i] + first_point));
      if (!kind && kinds[c] > 255) fail("has a type of cell that does not exist");
      grid_.cells.add(kind ? *kind : static_cast<CellKind>(kinds[c]), corners);
    }
    return cells;
  }

  void read_arrays(const pugi::xml_node& node, std::uint64_t rows, std::vector<Array>& into) {
    for (const pugi::xml_node array : node.children("DataArray")) {
      if (!xml_type(attribute(array, "type"))) continue;  // texts
      const std::string name(attribute(array, "Name"));
      const std::uint64_t components = array.attribute("NumberOfComponents") ? count(array, "NumberOfComponents") : 1;
      const auto more = values(array, rows * components);
      const Array* known = find_array(into, name);
      if (known == nullptr) into.push_back({name, components, {}});
      Array& whole = known == nullptr ? into.back() : into[static_cast<std::size_t>(known - into.data())];
      if (whole.components != components) fail("has pieces with different arrays \"" + name + "\"");
      whole.values.insert(whole.values.end(), more.begin(), more.end());
    }
  }

  pugi::xml_node array_named(const pugi::xml_node& node, const char* name) const {
    const pugi::xml_node array = node.find_child_by_attribute("DataArray", "Name", name);
    if (!array) fail(std::string("has no array \"") + name + "\" for its cells");
    return array;
  }

  std::vector<double> values(const pugi::xml_node& array, std::uint64_t number) {
    if (!array) fail("has a piece without points");
    const std::string what = name_ + ", array \"" + std::string(attribute(array, "Name")) + "\"";
    const auto type = xml_type(attribute(array, "type"));
    if (!type) fail("has values of type " + std::string(attribute(array, "type")), Status::unsupported_input);
    const std::string_view format = attribute(array, "format");
    const std::string_view content = array.text().get();
    if (format == "ascii") return text_values(content, number, what);
    if (format != "appended") return block_values(text::trimmed(content, blanks), false, storage_, *type, number, what);
    const std::uint64_t offset = count(array, "offset");
    if (offset > storage_.appended.size()) fail("ends before the data of its arrays; it is cut short");
    return block_values(storage_.appended.substr(offset), storage_.is_appended_raw, storage_, *type, number, what);
  }

  std::vector<std::uint64_t> indices(const pugi::xml_node& array, std::uint64_t number) {
    std::vector<std::uint64_t> result;
    for (const double value : values(array, number)) {
      if (!(value >= 0 && value < 4294967295.0)) fail("has an index that is negative or too large");
      result.push_back(static_cast<std::uint64_t>(value));
    }
    return result;
  }

  std::uint64_t count(const pugi::xml_node& node, const char* name) const {
    const std::string_view word = attribute(node, name);
    std::uint64_t value = 0;
    const bool is_offset = std::string_view(name) == "offset";
    if (!word.empty() && (!text::parse_integer(word, value) || (!is_offset && value > 0xffffffffu)))
      fail(std::string("has no number at ") + name);
    return value;
  }

  static std::string_view attribute(const pugi::xml_node& node, const char* name) {
    return node.attribute(name).value();
  }

  [[noreturn]] void fail(const std::string& what, Status status = Status::bad_input) const {
    throw Error{status, name_ + " " + what + (status == Status::bad_input ? "; export it again" : "")};
  }

  pugi::xml_document document_;
  pugi::xml_node file_;
  XmlStorage storage_;
  Grid grid_;
  const std::string& name_;
};

/// The whole of a time as a number; nothing for "0,5", "t=1" and "3 ms".
std::optional<double> whole_time(std::string_view word) {
  double time = 0;
  if (!text::next_real(word, time) || !text::trimmed(word, blanks).empty() || !std::isfinite(time)) return std::nullopt;
  return time;
}

}  // namespace

bool is_vtk_collection(std::string_view start) noexcept {
  return start.find("<VTKFile") != std::string_view::npos && start.find("\"Collection\"") != std::string_view::npos;
}

std::vector<GridState> read_vtk_collection(const std::filesystem::path& file) {
  const auto bytes = read_file(file);
  pugi::xml_document document;
  const pugi::xml_parse_result result = document.load_buffer(bytes.data(), bytes.size());
  const auto refuse = [&](Status status, const std::string& what) { throw Error{status, file.string() + what}; };
  if (!result)
    refuse(Status::bad_input, ", byte " + std::to_string(result.offset) + ": " + result.description() +
                                  " (XML); the file is damaged, export it again");
  std::vector<GridState> states;
  for (const pugi::xml_node entry : document.child("VTKFile").child("Collection").children("DataSet")) {
    const std::string word = entry.attribute("timestep").value();
    const auto time = whole_time(word);
    if (!time)
      refuse(Status::bad_input, word.empty() ? " names a file without a time; add timestep=\"...\""
                                             : ": the time \"" + word + "\" of " + entry.attribute("file").value() +
                                                   " is not a number; write one with a decimal point, without a unit");
    if (entry.attribute("file").empty() || *entry.attribute("file").value() == '\0')
      refuse(Status::bad_input, ": the entry at time " + word + " names no file; export it again");
    states.push_back({file.parent_path() / entry.attribute("file").value(), time, std::nullopt});
  }
  if (states.empty()) refuse(Status::bad_input, " names no file; export it again");
  std::stable_sort(states.begin(), states.end(), [](const auto& a, const auto& b) { return a.time < b.time; });
  for (std::size_t i = 1; i < states.size(); ++i)
    if (states[i].time == states[i - 1].time)
      refuse(Status::unsupported_input, " names several files at time " + std::to_string(*states[i].time) +
                                            "; join the parts into one file per time");
  return states;
}

bool is_vtk_xml(std::string_view start) noexcept {
  return start.find("<VTKFile") != std::string_view::npos && text::trimmed(start, blanks).starts_with('<');
}

Grid parse_vtk_xml(std::string_view bytes, const std::string& name) { return XmlParser(bytes, name).parse(false); }

Grid read_vtk_xml_time(const std::filesystem::path& file) {
  return XmlParser(as_text(read_file(file)), file.string()).parse(true);
}

}  // namespace lbea::io::grid
