#include "adapters/export/vtu.hpp"

#include "adapters/export/xml_text.hpp"
#include "adapters/files/atomic_file.hpp"

#include <lbea/lbea.hpp>

#include <cmath>

namespace lbea::io {
namespace {

std::string relative_name(const std::filesystem::path& file, const std::filesystem::path& pvd) {
  namespace fs = std::filesystem;
  const fs::path from_here = fs::absolute(file).lexically_normal();
  const fs::path folder = fs::absolute(pvd).lexically_normal().parent_path();
  return from_here.lexically_relative(folder).generic_string();
}

}  // namespace

void write_pvd(const std::filesystem::path& path, std::span<const PvdEntry> entries) {
  std::string text = "<?xml version=\"1.0\"?>\n<VTKFile type=\"Collection\" version=\"0.1\">\n<Collection>\n";
  for (const PvdEntry& entry : entries) {
    if (!std::isfinite(entry.time_s) || !entry.file.has_filename())
      throw Error(Status::bad_config, path.string() + ": every entry needs a finite time and a file, \"" +
                                          entry.file.string() + "\" at " + xml_number(entry.time_s) + " s has not");
    text += "<DataSet timestep=\"" + xml_number(entry.time_s) +
            "\" part=\"0\" file=" + xml_quoted(relative_name(entry.file, path)) + "/>\n";
  }
  AtomicFile file(path);
  file.write(text + "</Collection>\n</VTKFile>\n");
  file.commit();
}

}  // namespace lbea::io
