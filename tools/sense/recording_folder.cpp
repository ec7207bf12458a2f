#include "tools/sense/recording_folder.hpp"

#include "adapters/clouds/point_cloud.hpp"
#include "adapters/files/atomic_file.hpp"
#include "tools/shared/cli/csv_table.hpp"
#include "tools/shared/cli/formatted.hpp"

#include <nlohmann/json.hpp>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <system_error>

namespace lbea::tool {
namespace {

std::string file_name(std::uint64_t frame) {
  return formatted("frame_%05llu.ply", static_cast<unsigned long long>(frame));
}

/// The shortest text that reads back as the same number.
std::string shortest(double value) {
  std::array<char, 40> text{};
  return {text.data(), std::to_chars(text.data(), text.data() + text.size(), value).ptr};
}

bool belongs_to_recording(const std::filesystem::path& file) {
  const std::string name = file.filename().string();
  return name == "truth.csv" || (name.starts_with("frame_") && name.ends_with(".ply"));
}

/// Absolute, so that readers of truth.csv with another working folder find it.
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
                                              entry->path().filename().string() +
                                              "); choose another folder or empty it"};
  if (error) throw Error{Status::write_failed, "cannot use the folder " + folder.string() + ": " + error.message()};
}

/// The double with the shortest digits of the float: 0.1, not 0.10000000149.
double as_written(float value) {
  std::array<char, 40> text{};
  const auto end = std::to_chars(text.data(), text.data() + text.size(), value).ptr;
  double result = 0;
  std::from_chars(text.data(), end, result);
  return result;
}

}  // namespace

std::int64_t stamp_ns(double time_s) { return std::llround(time_s * 1e9); }

RecordingFolder::RecordingFolder(std::filesystem::path folder, const std::filesystem::path& run,
                                 std::string length_unit)
    : folder_(std::move(folder)), run_(run_path(run)), length_unit_(std::move(length_unit)) {
  make_empty(folder_);
}

void RecordingFolder::write_sensor(const std::string& json) const { io::write_file(folder_ / "sensor.json", json); }

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
  io::write_file(folder_ / "truth.csv", text);
}

std::string sensor_copy(const std::filesystem::path& original, const io::SensorDescription& used) {
  const auto bytes = io::read_file(original);
  auto json = nlohmann::ordered_json::parse(io::as_text(bytes));
  auto& camera = json["sensor"];
  camera["focal_px"] = as_written(used.sensor.focal_px);
  camera["width_px"] = used.sensor.width_px;
  camera["height_px"] = used.sensor.height_px;
  json.erase("noise_mm");  // replaced by "noise", in the length unit of the file as in SensingNoise
  json["noise"] = as_written(used.noise.sigma);
  json["outliers"] = as_written(used.noise.outliers);
  json["min_cos_incidence"] = as_written(used.noise.min_cos_incidence);
  json["dropout"] = as_written(used.noise.dropout);
  json["background"] = as_written(used.noise.background);
  return json.dump(1) + '\n';
}

}  // namespace lbea::tool
