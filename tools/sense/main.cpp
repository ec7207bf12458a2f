// lbea-sense: simulates the frames that a stereo rig captures of a run, with their true states.
#include "adapters/clouds/point_cloud.hpp"
#include "adapters/files/atomic_file.hpp"
#include "adapters/rig/sensor_json.hpp"
#include "adapters/simulation/open.hpp"
#include "precompute/rig/counter_random.hpp"
#include "precompute/rig/virtual_sensor.hpp"
#include "tools/sense/schedule.hpp"
#include "tools/shared/cli/progress.hpp"
#include "tools/shared/cli/tool.hpp"
#include "tools/shared/ensemble/ensemble_input.hpp"
#include "tools/shared/text/csv_table.hpp"
#include "tools/shared/text/formatted.hpp"

#include <nlohmann/json.hpp>

#include <algorithm>
#include <charconv>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <optional>

namespace lbea::tool {
namespace {

struct Options {
  std::filesystem::path run, sensor, out;
  std::string steps = "all";
  std::optional<double> rate_hz;
  std::optional<std::uint32_t> max_frames;
  std::uint64_t seed = 1;
  double scale = 1;
  std::optional<float> sigma, outliers, dropout, background;
  bool single_file = false, json = false;
};

struct Summary {
  std::uint64_t planned = 0, frames = 0, points = 0;
  double seconds = 0;
};

void declare(Tool& tool, Options& options) {
  tool.add_option("RUN", options.run, "a run: its first file, or its folder")->required();
  tool.add_flag("--single-file", options.single_file, single_file_help);
  tool.add_option("--sensor", options.sensor, "sensor.json: the rig and its noise")->required();
  tool.add_option("--out", options.out, "folder to write the frames, sensor.json and truth.csv to")->required();
  const auto steps_check = [](const std::string& text) {
    return parse_steps(text) ? std::string() : "'" + text + "' is not all, N, FIRST:LAST or FIRST:LAST:STRIDE";
  };
  tool.add_option("--steps", options.steps, "stored states: all, N, FIRST:LAST or FIRST:LAST:STRIDE (inclusive)")
      ->check(Check(steps_check, "STEPS"));
  tool.add_option("--rate", options.rate_hz,
                  "frames per second, interpolated between all stored states from the first to the last of --steps")
      ->check(positive_number());
  tool.add_option("--frames", options.max_frames, "stop after this many frames")
      ->check(in_range(std::uint32_t{1}, std::numeric_limits<std::uint32_t>::max()));
  tool.add_option("--seed", options.seed, "seed of the noise");
  tool.add_option("--scale", options.scale, "resolution: scales width, height and focal length")
      ->check(positive_number());
  const char* from_file = " (default: sensor.json's)";
  tool.add_option("--noise", options.sigma,
                  std::string("standard deviation along the line of sight, length unit") + from_file)
      ->check(non_negative_number());
  tool.add_option("--outliers", options.outliers, std::string("share of points that are outliers") + from_file)
      ->check(in_range(0.0, 1.0));
  tool.add_option("--dropout", options.dropout, std::string("share of points lost at random") + from_file)
      ->check(in_range(0.0, 1.0));
  tool.add_option("--background", options.background,
                  std::string("additional points on a wall behind the component, as a share") + from_file)
      ->check(non_negative_number());
  tool.add_flag("--json", options.json, "print the summary as JSON");
}

io::SensorDescription described(const Options& options) {
  io::SensorDescription description = io::read_sensor_json(options.sensor);
  description.sensor = bake::scaled(description.sensor, options.scale);
  bake::SensingNoise& noise = description.noise;
  noise.sigma = options.sigma.value_or(noise.sigma);
  noise.outliers = options.outliers.value_or(noise.outliers);
  noise.dropout = options.dropout.value_or(noise.dropout);
  noise.background = options.background.value_or(noise.background);
  return description;
}

std::vector<FrameTime> planned_frames(const Options& options, const bake::SimulationReader& reader) {
  std::vector<double> times;
  for (std::uint32_t state = 0; state < reader.states(); ++state) times.push_back(reader.time_s(state));
  const StepRange steps = parse_steps(options.steps).value();
  const std::size_t most = options.max_frames.value_or(std::numeric_limits<std::uint32_t>::max());
  if (options.rate_hz) return resampled_frames(times, steps, *options.rate_hz, most);
  auto frames = stored_frames(times, steps);
  frames.resize(std::min(frames.size(), most));
  return frames;
}

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

std::int64_t stamp_ns(double time_s) { return std::llround(time_s * 1e9); }

/// The folder of a virtual recording: frames, sensor.json and truth.csv.
class RecordingFolder {
 public:
  /// Creates the folder. Throws Error{write_failed} when that fails or when it already holds a recording.
  RecordingFolder(std::filesystem::path folder, const std::filesystem::path& run, std::string length_unit)
      : folder_(std::move(folder)), run_(run_path(run)), length_unit_(std::move(length_unit)) {
    make_empty(folder_);
  }
  void write_sensor(const std::string& json) const { io::write_file(folder_ / "sensor.json", json); }
  void write_frame(const FrameTime& moment, std::span<const Point> points) {
    const std::string comment =
        "length unit " + length_unit_ + ", sensor coordinates, stamp_ns " + std::to_string(stamp_ns(moment.time_s));
    io::write_ply(folder_ / file_name(written_.size()), points, std::span(&comment, 1));
    written_.push_back(moment);
  }
  /// truth.csv, with a row per frame written so far.
  void write_truth() const {
    std::string text = "frame,file,stamp_ns,run,state,time_s\n";
    for (std::uint64_t frame = 0; frame < written_.size(); ++frame) {
      const auto& [state, time_s] = written_[frame];
      text += std::to_string(frame) + ',' + file_name(frame) + ',' + std::to_string(stamp_ns(time_s)) + ',' +
              csv_field(run_) + ',' + shortest(state) + ',' + shortest(time_s) + '\n';
    }
    io::write_file(folder_ / "truth.csv", text);
  }

 private:
  std::filesystem::path folder_;
  std::string run_, length_unit_;
  std::vector<FrameTime> written_;
};

/// The text of the sensor.json `original` with the resolution and the noise of `used`; poses and all other entries are
/// unchanged. `original` must be a file that read_sensor_json() accepts.
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

Summary sense(const Options& options) {
  const auto begin = std::chrono::steady_clock::now();
  const io::SensorDescription description = described(options);
  const auto reader = open_named_run(options.run, options.single_file);
  const auto plan = planned_frames(options, *reader);
  catch_stop_signals();  // until here nothing is written, and a signal ends the program at once
  const bake::VirtualSensor sensor(description.sensor, reader->mesh().nodes(), reader->mesh().elements);
  RecordingFolder folder(options.out, options.run, description.length_unit);
  folder.write_sensor(sensor_copy(options.sensor, description));

  Summary summary;
  summary.planned = plan.size();
  StateSource states(*reader);
  Progress progress("sensing", plan.size());
  for (const FrameTime& moment : plan) {
    if (stop_requested) break;
    const bake::SimulationState& state = states.at(moment.state);
    const auto points = sensor.sense({state.positions, exposed_elements(reader->mesh(), state.alive)},
                                     description.noise, bake::frame_seed(options.seed, summary.frames));
    folder.write_frame(moment, points);
    summary.points += points.size();
    progress.advance_to(++summary.frames);
  }
  folder.write_truth();
  summary.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  return summary;
}

void print(const Options& options, const Summary& summary) {
  if (options.json) {
    const nlohmann::ordered_json json{{"out", options.out.string()},
                                      {"frames_planned", summary.planned},
                                      {"frames", summary.frames},
                                      {"points", summary.points},
                                      {"seconds", summary.seconds}};
    std::printf("%s\n", json.dump().c_str());
    return;
  }
  const auto frames = static_cast<double>(std::max<std::uint64_t>(summary.frames, 1));
  std::printf("%llu frames, %.0f points each on average, in %s (%.1f s)\n",
              static_cast<unsigned long long>(summary.frames), static_cast<double>(summary.points) / frames,
              options.out.c_str(), summary.seconds);
}

int run(const Options& options) {
  const Summary summary = sense(options);
  print(options, summary);
  if (summary.frames == summary.planned) return exit_ok;
  std::fprintf(stderr,
               "lbea-sense: stopped after %llu of %llu frames; the written frames are complete and in truth.csv\n",
               static_cast<unsigned long long>(summary.frames), static_cast<unsigned long long>(summary.planned));
  return exit_failed;
}

}  // namespace
}  // namespace lbea::tool

int main(int argc, char** argv) {
  using namespace lbea::tool;
  Options options;
  Tool tool("lbea-sense", "Simulates the frames that a stereo sensor captures of a simulation run.",
            "lbea-sense runs/run_013 --sensor sensor.json --out frames --steps 2:30:4");
  declare(tool, options);
  tool.list_formats_by(lbea::io::list_simulation_formats());
  return tool.run(argc, argv, [&] { return run(options); });
}
