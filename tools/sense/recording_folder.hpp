// The folder a virtual recording is written to: frames, the sensor that saw them, and what they truly show.
#pragma once

#include <lbea/lbea.hpp>

#include <filesystem>
#include <span>
#include <string>
#include <vector>

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
  /// Makes the folder. Throws Error{write_failed} when that fails or it already holds a recording.
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

}  // namespace lbea::tool
