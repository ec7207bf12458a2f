// The folder of a virtual recording: frames, sensor.json and truth.csv.
#pragma once

#include "adapters/rig/sensor_json.hpp"

#include <lbea/lbea.hpp>

namespace lbea::tool {

/// One row of truth.csv.
struct FrameTruth {
  std::uint64_t frame;
  double state;  // fractional between stored states
  double time_s;
};
[[nodiscard]] std::int64_t stamp_ns(double time_s);

class RecordingFolder {
 public:
  /// Creates the folder. Throws Error{write_failed} when that fails or when it already holds a recording.
  RecordingFolder(std::filesystem::path folder, const std::filesystem::path& run, std::string length_unit);

  void write_sensor(const std::string& json) const;
  void write_frame(const FrameTruth& truth, std::span<const Point> points);
  /// truth.csv, with a row per frame written so far.
  void write_truth() const;

 private:
  std::filesystem::path folder_;
  std::string run_, length_unit_;
  std::vector<FrameTruth> written_;
};

/// The text of the sensor.json `original` with the resolution and the noise of `used`; poses and all other entries are
/// unchanged. `original` must be a file that read_sensor_json() accepts.
[[nodiscard]] std::string sensor_copy(const std::filesystem::path& original, const io::SensorDescription& used);

}  // namespace lbea::tool
