#include "adapters/export/vtu.hpp"

#include "adapters/files/atomic_file.hpp"

#include <lbea/lbea.hpp>

#include <bit>
#include <charconv>
#include <cmath>

namespace lbea::io {
namespace {
static_assert(std::endian::native == std::endian::little, "values are written in their memory layout");

/// `text` between quotes. Throws Error{bad_config} for control characters, which XML cannot hold.
std::string xml_quoted(std::string_view text) {
  constexpr std::string_view special = "&<>\"";
  constexpr std::array names{"&amp;", "&lt;", "&gt;", "&quot;"};
  std::string quoted = "\"";
  for (const char c : text) {
    if (static_cast<unsigned char>(c) < 0x20)
      throw Error(Status::bad_config, "a name with a control character cannot be written to XML: rename it");
    const std::size_t at = special.find(c);
    quoted += at == special.npos ? std::string(1, c) : names[at];
  }
  return quoted + '"';
}

/// The shortest decimal that reads back as the same double.
std::string xml_number(double value) {
  std::array<char, 32> digits{};
  const auto end = std::to_chars(digits.data(), digits.data() + digits.size(), value).ptr;
  return {digits.data(), end};
}

constexpr std::uint8_t vtk_triangle = 5, vtk_quad = 9;
using Bytes = std::span<const std::byte>;
using Cell = std::span<const std::uint32_t>;

Bytes bytes_of(const VtuArray& array) {
  return std::visit([](auto values) -> Bytes { return std::as_bytes(values); }, array.values);
}

bool is_triangle(Cell cell) { return cell[2] == cell[3]; }
std::size_t corners_of(Cell cell) { return is_triangle(cell) ? 3 : 4; }

class VtuWriter {
 public:
  VtuWriter(const std::filesystem::path& path, const VtuGrid& grid) : path_(path), grid_(grid) {
    check_mesh();
    check_arrays(grid.point_arrays, points());
    check_arrays(grid.cell_arrays, cells());
    for (std::size_t i = 0; i < cells(); ++i) corners_ += corners_of(cell(i));
  }

  void write() {
    AtomicFile file(path_);
    file.write(description());
    write_block(file, std::as_bytes(grid_.positions));
    write_topology(file);
    for (const VtuArray& array : grid_.point_arrays) write_block(file, bytes_of(array));
    for (const VtuArray& array : grid_.cell_arrays) write_block(file, bytes_of(array));
    file.write("\n</AppendedData>\n</VTKFile>\n");
    file.commit();
  }

 private:
  [[nodiscard]] std::size_t points() const { return grid_.positions.size() / 3; }
  [[nodiscard]] std::size_t cells() const { return grid_.element_nodes.size() / 4; }
  [[nodiscard]] Cell cell(std::size_t i) const { return grid_.element_nodes.subspan(4 * i, 4); }

  void check_mesh() const {
    if (grid_.positions.size() % 3 != 0) fail("positions are not three per point");
    if (grid_.element_nodes.size() % 4 != 0) fail("element nodes are not four per element");
    for (std::size_t i = 0; i < grid_.element_nodes.size(); ++i)
      if (grid_.element_nodes[i] >= points())
        fail("element " + std::to_string(i / 4) + " names node " + std::to_string(grid_.element_nodes[i]) + " of " +
             std::to_string(points()));
  }

  void check_arrays(const std::vector<VtuArray>& arrays, std::size_t rows) const {
    for (const VtuArray& array : arrays) {
      const std::size_t values = bytes_of(array).size() / 4;
      if (array.name.empty()) fail("an array without a name");
      if (array.components == 0 || values % array.components != 0 || values / array.components != rows)
        fail("array \"" + array.name + "\" has " + std::to_string(values) + " values for " + std::to_string(rows) +
             " x " + std::to_string(array.components));
    }
  }

  /// The XML before the appended data. It lists the blocks in the order in which write() appends them.
  std::string description() {
    std::string xml =
        "<?xml version=\"1.0\"?>\n<VTKFile type=\"UnstructuredGrid\" version=\"1.0\" byte_order=\"LittleEndian\" "
        "header_type=\"UInt64\">\n<UnstructuredGrid>\n";
    if (grid_.time_s)
      xml += "<FieldData>\n<DataArray type=\"Float64\" Name=\"TimeValue\" NumberOfTuples=\"1\" format=\"ascii\">" +
             xml_number(*grid_.time_s) + "</DataArray>\n</FieldData>\n";
    xml += "<Piece NumberOfPoints=\"" + std::to_string(points()) + "\" NumberOfCells=\"" + std::to_string(cells()) +
           "\">\n";
    // One statement per block, because entry() assigns the offsets in the order of its calls.
    xml += "<Points>\n";
    xml += entry("Float32", "Points", 3, grid_.positions.size_bytes());
    xml += "</Points>\n<Cells>\n";
    xml += entry("Int64", "connectivity", 1, corners_ * sizeof(std::int64_t));
    xml += entry("Int64", "offsets", 1, cells() * sizeof(std::int64_t));
    xml += entry("UInt8", "types", 1, cells());
    xml += "</Cells>\n<PointData>\n";
    xml += entries(grid_.point_arrays);
    xml += "</PointData>\n<CellData>\n";
    xml += entries(grid_.cell_arrays);
    return xml + "</CellData>\n</Piece>\n</UnstructuredGrid>\n<AppendedData encoding=\"raw\">\n_";
  }

  std::string entries(const std::vector<VtuArray>& arrays) {
    std::string xml;
    for (const VtuArray& array : arrays) {
      const bool is_float = std::holds_alternative<std::span<const float>>(array.values);
      xml += entry(is_float ? "Float32" : "UInt32", array.name, array.components, bytes_of(array).size());
    }
    return xml;
  }

  std::string entry(const std::string& type, const std::string& name, std::uint32_t components, std::size_t size) {
    const std::string xml = "<DataArray type=\"" + type + "\" Name=" + xml_quoted(name) + " NumberOfComponents=\"" +
                            std::to_string(components) + "\" format=\"appended\" offset=\"" + std::to_string(offset_) +
                            "\"/>\n";
    offset_ += sizeof(std::uint64_t) + size;  // every block begins with its length
    return xml;
  }

  void write_topology(AtomicFile& file) const {
    write_length(file, corners_ * sizeof(std::int64_t));
    for (std::size_t i = 0; i < cells(); ++i)
      for (const std::uint32_t node : cell(i).first(corners_of(cell(i)))) write_index(file, node);
    write_length(file, cells() * sizeof(std::int64_t));
    std::uint64_t end = 0;
    for (std::size_t i = 0; i < cells(); ++i) write_index(file, end += corners_of(cell(i)));
    write_length(file, cells());
    for (std::size_t i = 0; i < cells(); ++i) {
      const std::uint8_t type = is_triangle(cell(i)) ? vtk_triangle : vtk_quad;
      file.write(std::as_bytes(std::span(&type, 1)));
    }
  }

  static void write_index(AtomicFile& file, std::uint64_t value) { file.write(std::as_bytes(std::span(&value, 1))); }
  static void write_length(AtomicFile& file, std::uint64_t bytes) { write_index(file, bytes); }
  static void write_block(AtomicFile& file, Bytes bytes) {
    write_length(file, bytes.size());
    file.write(bytes);
  }

  [[noreturn]] void fail(const std::string& what) const {
    throw Error(Status::bad_config, "cannot write " + path_.string() + ": " + what);
  }

  const std::filesystem::path& path_;
  const VtuGrid& grid_;
  std::uint64_t corners_ = 0;  // of all cells together
  std::uint64_t offset_ = 0;   // of the next block in the appended data
};

std::string relative_name(const std::filesystem::path& file, const std::filesystem::path& pvd) {
  namespace fs = std::filesystem;
  const fs::path from_here = fs::absolute(file).lexically_normal();
  const fs::path folder = fs::absolute(pvd).lexically_normal().parent_path();
  return from_here.lexically_relative(folder).generic_string();
}
}  // namespace

void write_vtu(const std::filesystem::path& path, const VtuGrid& grid) { VtuWriter(path, grid).write(); }

void write_pvd(const std::filesystem::path& path, std::span<const PvdEntry> entries) {
  std::string text = "<?xml version=\"1.0\"?>\n<VTKFile type=\"Collection\" version=\"0.1\">\n<Collection>\n";
  for (const PvdEntry& entry : entries) {
    if (!std::isfinite(entry.time_s) || !entry.file.has_filename())
      throw Error(Status::bad_config, path.string() + ": every entry needs a finite time and a file, \"" +
                                          entry.file.string() + "\" at " + xml_number(entry.time_s) + " s has not");
    text += "<DataSet timestep=\"" + xml_number(entry.time_s) +
            "\" part=\"0\" file=" + xml_quoted(relative_name(entry.file, path)) + "/>\n";
  }
  write_file(path, text + "</Collection>\n</VTKFile>\n");
}
}  // namespace lbea::io
