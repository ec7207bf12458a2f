#include "adapters/simulation/vtk/vtk_collection.hpp"

#include <pugixml.hpp>

#include <algorithm>
#include <cmath>

#include "adapters/files/atomic_file.hpp"

namespace lbea::io::grid {
namespace {

std::filesystem::path beside(const std::filesystem::path& collection, const std::string& name) {
  const std::filesystem::path file = name;
  return file.is_absolute() ? file : collection.parent_path() / file;
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
    const double time = entry.attribute("timestep").as_double(std::nan(""));
    if (!std::isfinite(time)) refuse(Status::bad_input, " names a file without a time; add timestep=\"...\"");
    states.push_back({beside(file, entry.attribute("file").value()), time});
  }
  if (states.empty()) refuse(Status::bad_input, " names no file; export it again");
  std::stable_sort(states.begin(), states.end(), [](const auto& a, const auto& b) { return a.time < b.time; });
  for (std::size_t i = 1; i < states.size(); ++i)
    if (states[i].time == states[i - 1].time)
      refuse(Status::unsupported_input, " names several files at time " + std::to_string(*states[i].time) +
                                            "; join the parts to one file per time");
  return states;
}

}  // namespace lbea::io::grid
