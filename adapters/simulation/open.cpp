#include "adapters/simulation/open.hpp"

#include <algorithm>
#include <fstream>

#include "adapters/simulation/d3plot/d3plot_reader.hpp"
#include "adapters/simulation/formats.hpp"
#include "adapters/simulation/series.hpp"

namespace lbea::io {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t looked_at = 8192;

std::string start_of(const fs::path& file) {
  std::string start(looked_at, '\0');
  std::error_code error;
  if (!fs::is_regular_file(file, error)) return {};  // opening a fifo would wait for its writer
  std::ifstream in(file, std::ios::binary);
  in.read(start.data(), static_cast<std::streamsize>(start.size()));
  start.resize(static_cast<std::size_t>(in.gcount()));
  return start;
}

const SimulationFormat* format_of(const fs::path& file) {
  const std::string start = start_of(file);
  const auto formats = simulation_formats();
  const auto found =
      std::find_if(formats.begin(), formats.end(), [&](const auto& format) { return format.is_it(file, start); });
  return found == formats.end() ? nullptr : &*found;
}

/// The only run in a folder; a collection stands for the files it names.
fs::path only_run(const fs::path& folder) {
  std::vector<fs::path> runs;
  for (const fs::path& file : first_files(folder)) {
    const SimulationFormat* format = format_of(file);
    if (format != nullptr && std::string_view(format->name) == "ParaView collection") return file;
    if (format != nullptr) runs.push_back(file);
  }
  if (runs.empty())
    throw Error{Status::file_not_found, folder.string() + " holds no file named d3plot and no other run (" +
                                            simulation_format_names() + "); give the first file of the run itself"};
  if (runs.size() > 1)
    throw Error{Status::bad_input, folder.string() + " holds more than one run, for instance " +
                                       runs[0].filename().string() + " and " + runs[1].filename().string() +
                                       "; give the first file of one"};
  return runs.front();
}

fs::path first_file(const fs::path& path) {
  std::error_code error;
  if (!fs::is_directory(path, error)) return path;
  const fs::path d3plot = path / "d3plot";
  return fs::exists(d3plot, error) ? d3plot : only_run(path);
}

}  // namespace

std::unique_ptr<bake::SimulationReader> open_d3plot(const fs::path& first_file) {
  return std::make_unique<d3plot::Reader>(first_file);
}

std::unique_ptr<bake::SimulationReader> open_simulation(const fs::path& path) {
  const fs::path file = first_file(path);
  if (const SimulationFormat* format = format_of(file)) return format->open(file);
  throw Error{Status::unsupported_input,
              file.string() + ", byte 0: the file is of none of the formats that are read (" +
                  simulation_format_names() + "), or it is compressed; give the first file of such a run"};
}

std::string simulation_format_names() {
  std::string names;
  for (const SimulationFormat& format : simulation_formats())
    names += (names.empty() ? "" : ", ") + std::string(format.name);
  return names;
}

std::string list_simulation_formats() {
  std::string list = "Simulations, told by content; give a run's first file or a folder with one run:\n";
  for (const SimulationFormat& format : simulation_formats()) {
    const std::string name = format.name;
    list += "  " + name + std::string(name.size() < 21 ? 21 - name.size() : 1, ' ') + format.what + "\n";
  }
  return list;
}

}  // namespace lbea::io
