#include "adapters/simulation/open.hpp"

#include <array>

#include "adapters/simulation/d3plot_encoding.hpp"
#include "adapters/simulation/d3plot_reader.hpp"

namespace lbea {

namespace {

namespace fs = std::filesystem;

struct Format {
  const char* name;
  bool (*is_it)(const fs::path& file);
  std::unique_ptr<SimulationReader> (*open)(const fs::path& file);
};

bool is_d3plot(const fs::path& file) { return d3plot::detect_encoding(d3plot::WordFile(file)).has_value(); }

constexpr std::array formats{Format{"LS-DYNA d3plot", is_d3plot, open_d3plot}};

fs::path first_file(const fs::path& path) {
  std::error_code error;
  if (!fs::is_directory(path, error)) return path;
  const fs::path file = path / "d3plot";
  if (!fs::exists(file, error))
    throw Error{Status::file_not_found,
                path.string() + " holds no file named d3plot; give the first file of the run itself"};
  return file;
}

}  // namespace

std::unique_ptr<SimulationReader> open_d3plot(const fs::path& first_file) {
  return std::make_unique<d3plot::Reader>(first_file);
}

std::unique_ptr<SimulationReader> open_simulation(const fs::path& path) {
  const fs::path file = first_file(path);
  for (const Format& format : formats)
    if (format.is_it(file)) return format.open(file);
  std::string known;
  for (const Format& format : formats) known += (known.empty() ? "" : ", ") + std::string(format.name);
  throw Error{Status::unsupported_input, file.string() + ", byte 0: the file is of none of the formats that are read (" +
                                             known + "), or it is compressed; give the first file of such a run"};
}

}  // namespace lbea
