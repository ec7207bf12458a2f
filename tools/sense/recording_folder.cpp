#include "tools/sense/recording_folder.hpp"

#include "adapters/clouds/point_cloud.hpp"
#include "adapters/files/atomic_file.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <cstdio>
#include <system_error>

namespace lbea::tool {
namespace {

std::string file_name(std::uint64_t frame) {
  std::array<char, 40> name{};
  std::snprintf(name.data(), name.size(), "frame_%05llu.ply", static_cast<unsigned long long>(frame));
  return name.data();
}

/// The shortest text that reads back as the same number.
std::string shortest(double value) {
  std::array<char, 40> text{};
  return {text.data(), std::to_chars(text.data(), text.data() + text.size(), value).ptr};
}

std::string csv_field(const std::string& text) {
  if (text.find_first_of(",\"\r\n") == std::string::npos) return text;
  std::string quoted = "\"";
  for (const char c : text) quoted += c == '"' ? std::string("\"\"") : std::string(1, c);
  return quoted + '"';
}

bool belongs_to_recording(const std::filesystem::path& file) {
  const std::string name = file.filename().string();
  return name == "truth.csv" || (name.starts_with("frame_") && name.ends_with(".ply"));
}

/// Absolute, so that it is found from wherever truth.csv is read.
std::string run_path(const std::filesystem::path& run) {
  const auto path = std::filesystem::absolute(run).lexically_normal();
  return (path.has_filename() ? path : path.parent_path()).string();
}

void make_empty(const std::filesystem::path& folder) {
  std::error_code error;
  std::filesystem::create_directories(folder, error);
  if (!error)
    for (auto entry = std::filesystem::directory_iterator(folder, error);
         !error && entry != std::filesystem::directory_iterator(); entry.increment(error))
      if (belongs_to_recording(entry->path()))
        throw Error{Status::write_failed, folder.string() + " already holds a recording (" +
                                              entry->path().filename().string() + "); name another folder or empty it"};
  if (error) throw Error{Status::write_failed, "cannot use the folder " + folder.string() + ": " + error.message()};
}

void write_text(const std::filesystem::path& path, const std::string& text) {
  io::AtomicFile file(path);
  file.write(text);
  file.commit();
}

}  // namespace

std::int64_t stamp_ns(double time_s) { return std::llround(time_s * 1e9); }

RecordingFolder::RecordingFolder(std::filesystem::path folder, const std::filesystem::path& run,
                                 std::string length_unit)
    : folder_(std::move(folder)), run_(run_path(run)), length_unit_(std::move(length_unit)) {
  make_empty(folder_);
}

void RecordingFolder::write_sensor(const std::string& json) const { write_text(folder_ / "sensor.json", json); }

void RecordingFolder::write_frame(const FrameTruth& truth, std::span<const Point> points) {
  const std::string comment =
      "length unit " + length_unit_ + ", sensor coordinates, stamp_ns " + std::to_string(stamp_ns(truth.time_s));
  io::write_ply(folder_ / file_name(truth.frame), points, std::span(&comment, 1));
  written_.push_back(truth);
}

void RecordingFolder::write_truth() const {
  std::string text = "frame,file,stamp_ns,run,state,time_s\n";
  for (const FrameTruth& row : written_)
    text += std::to_string(row.frame) + ',' + file_name(row.frame) + ',' + std::to_string(stamp_ns(row.time_s)) + ',' +
            csv_field(run_) + ',' + shortest(row.state) + ',' + shortest(row.time_s) + '\n';
  write_text(folder_ / "truth.csv", text);
}

}  // namespace lbea::tool
