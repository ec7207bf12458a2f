// Parallel VTK files (.pvtu, .pvtp): XML that names the files of the pieces of one mesh.
#include "adapters/files/atomic_file.hpp"
#include "adapters/files/text_line.hpp"
#include "adapters/simulation/grid/pieces.hpp"
#include "adapters/simulation/vtk/vtk.hpp"

#include <pugixml.hpp>

#include <fstream>

namespace lbea::io::grid {
namespace {
namespace fs = std::filesystem;

constexpr std::size_t most_pieces = 100'000;
constexpr std::size_t start_bytes = 4096;  // have the type of the file

[[noreturn]] void refuse(const std::string& file, const std::string& what, Status status = Status::bad_input) {
  throw Error{status, file + what};
}

pugi::xml_document loaded(std::string_view bytes, const std::string& name) {
  pugi::xml_document document;
  const pugi::xml_parse_result result = document.load_buffer(bytes.data(), bytes.size());
  if (!result)
    refuse(name, ", byte " + std::to_string(result.offset) + ": " + result.description() +
                     " (XML); the file is damaged or cut short, export it again");
  return document;
}

pugi::xml_node data_of(const pugi::xml_document& document, const std::string& name) {
  const pugi::xml_node file = document.child("VTKFile");
  const std::string type = file.attribute("type").value();
  const pugi::xml_node data = file.child(type.c_str());
  if (!data || (type != "PUnstructuredGrid" && type != "PPolyData"))
    refuse(name, " holds neither a PUnstructuredGrid nor PPolyData; export the mesh as .pvtu or .pvtp",
           Status::unsupported_input);
  return data;
}

std::vector<fs::path> sources(const pugi::xml_node& data, const std::string& name) {
  std::vector<fs::path> files;
  for (const pugi::xml_node piece : data.children("Piece")) {
    const std::string number = std::to_string(files.size());
    const fs::path source = piece.attribute("Source").value();
    if (source.empty()) refuse(name, ": piece " + number + " names no file; export it again");
    if (files.size() == most_pieces) refuse(name, " names more than " + std::to_string(most_pieces) + " pieces");
    files.push_back(fs::path(name).parent_path() / source);
    std::error_code error;
    if (!fs::is_regular_file(files.back(), error))
      refuse(name, ": piece " + number + ", " + source.string() + ", is not a file that can be read; copy it along",
             Status::file_not_found);
  }
  if (files.empty()) refuse(name, " names no pieces; export it again");
  return files;
}

bool is_parallel_file(const fs::path& file) {
  std::error_code error;
  if (!fs::is_regular_file(file, error)) return false;  // opening a fifo would wait for its writer
  std::string start(start_bytes, '\0');
  std::ifstream in(file, std::ios::binary);
  in.read(start.data(), static_cast<std::streamsize>(start.size()));
  return is_vtk_parallel(start);
}

std::optional<double> own_time(const pugi::xml_node& data, const std::string& name) {
  const pugi::xml_node array = data.child("FieldData").find_child_by_attribute("DataArray", "Name", "TimeValue");
  if (std::string_view(array.attribute("format").value()) != "ascii") return std::nullopt;  // the pieces have it, too
  std::string_view rest = array.text().get();
  double time = 0;
  if (!text::next_real(rest, time) || !text::trimmed(rest, " \t\r\n").empty())
    refuse(name, ": its TimeValue \"" + std::string(array.text().get()) + "\" is not a number; export it again");
  return time;
}
}  // namespace

bool is_vtk_parallel(std::string_view start) noexcept {
  return is_vtk_xml(start) && (start.find("\"PUnstructuredGrid\"") != std::string_view::npos ||
                               start.find("\"PPolyData\"") != std::string_view::npos);
}

std::vector<fs::path> list_vtk_pieces(const fs::path& file) {
  if (!is_parallel_file(file)) return {};
  const auto bytes = read_file(file);
  return sources(data_of(loaded(as_text(bytes), file.string()), file.string()), file.string());
}

Grid parse_vtk_parallel(std::string_view bytes, const std::string& name) {
  const pugi::xml_document document = loaded(bytes, name);
  const pugi::xml_node data = data_of(document, name);
  Grid whole;
  whole.time = own_time(data, name);
  for (const fs::path& file : sources(data, name)) {
    const auto content = read_file(file);
    const Grid piece = parse_vtk_xml(as_text(content), file.string());
    check_grid(piece, file.string());
    add_piece(piece, file.string(), whole);
  }
  return whole;
}

Grid read_vtk_parallel_time(const fs::path& file) {
  const auto bytes = read_file(file);
  const pugi::xml_document document = loaded(as_text(bytes), file.string());
  const pugi::xml_node data = data_of(document, file.string());
  Grid grid;
  grid.time = own_time(data, file.string());
  return grid.time ? grid : read_vtk_xml_time(sources(data, file.string()).front());
}

Grid read_vtk_member(const fs::path& file) {
  const bool is_parallel = is_parallel_file(file);
  const auto bytes = read_file(file);
  return is_parallel ? parse_vtk_parallel(as_text(bytes), file.string()) : parse_vtk_xml(as_text(bytes), file.string());
}
}  // namespace lbea::io::grid
