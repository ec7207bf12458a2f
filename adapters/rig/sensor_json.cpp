#include "adapters/rig/sensor_json.hpp"

#include "adapters/files/atomic_file.hpp"

#include <nlohmann/json.hpp>

#include <algorithm>
#include <cmath>
#include <initializer_list>

namespace lbea::io {
namespace {

using Json = nlohmann::json;

constexpr double rotation_tolerance = 1e-4;  // poses are often written with few digits
constexpr double most_pixels = 65'536;       // along one side

/// An object of the file, with the prefix of its keys in messages.
class JsonTable {
 public:
  JsonTable(const Json& json, const std::filesystem::path& file, std::string prefix = "")
      : json_(json), file_(file), prefix_(std::move(prefix)) {
    if (!json.is_object()) fail("", "is not an object");
  }

  [[nodiscard]] const Json* find(const char* key) const {
    const auto at = json_.find(key);
    return at == json_.end() ? nullptr : &*at;
  }
  [[nodiscard]] const Json& at(const char* key) const {
    const Json* value = find(key);
    if (value == nullptr) fail(key, "is missing");
    return *value;
  }
  [[nodiscard]] JsonTable table(const char* key) const { return {at(key), file_, prefix_ + key + "."}; }

  /// A number from `least` to `most`.
  [[nodiscard]] double number(const char* key, double least, double most) const {
    const Json& value = at(key);
    const double number = value.is_number() ? value.get<double>() : std::numeric_limits<double>::quiet_NaN();
    if (!(number >= least && number <= most))
      fail(key, "needs a number from " + Json(least).dump() + " to " + Json(most).dump());
    return number;
  }
  void read(const char* key, float& into, double least, double most) const {
    if (find(key) != nullptr) into = static_cast<float>(number(key, least, most));
  }

  [[nodiscard]] std::uint32_t pixels(const char* key) const {
    const double value = number(key, 1, most_pixels);
    if (value != std::floor(value)) fail(key, "needs a whole number");
    return static_cast<std::uint32_t>(value);
  }

  [[nodiscard]] RigidTransform pose(const char* key) const;

  void refuse_unknown_keys(std::initializer_list<std::string_view> known) const {
    for (const auto& [key, value] : json_.items())
      if (std::find(known.begin(), known.end(), key) == known.end()) fail(key, "is not a key known here");
  }

  [[noreturn]] void fail(const std::string& key, const std::string& what) const {
    throw Error(Status::bad_input, file_.string() + ": \"" + prefix_ + key + "\" " + what);
  }

 private:
  const Json& json_;
  const std::filesystem::path& file_;
  std::string prefix_;
};

using Rotation = std::array<std::array<double, 3>, 3>;

double dot(const std::array<double, 3>& a, const std::array<double, 3>& b) {
  return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

/// R R' = I and det R = 1, within the tolerance.
bool is_rotation(const Rotation& r) {
  for (std::size_t i = 0; i < 3; ++i)
    for (std::size_t j = 0; j < 3; ++j)
      if (!(std::abs(dot(r[i], r[j]) - (i == j ? 1 : 0)) <= rotation_tolerance)) return false;
  const std::array<double, 3> cross{r[0][1] * r[1][2] - r[0][2] * r[1][1], r[0][2] * r[1][0] - r[0][0] * r[1][2],
                                    r[0][0] * r[1][1] - r[0][1] * r[1][0]};
  return dot(cross, r[2]) > 0;
}

bool is_row(const Json& row) {
  return row.is_array() && row.size() == 4 &&
         std::all_of(row.begin(), row.end(), [](const Json& value) { return value.is_number(); });
}

RigidTransform JsonTable::pose(const char* key) const {
  const Json& rows = at(key);
  const bool has_last_row = rows.is_array() && rows.size() == 4 && rows[3] == Json({0, 0, 0, 1});
  if (!rows.is_array() || (rows.size() != 3 && !has_last_row) || !std::all_of(rows.begin(), rows.end(), is_row))
    fail(key, "needs three rows of four numbers");
  RigidTransform transform{};
  Rotation rotation{};
  for (std::size_t i = 0; i < 3; ++i)
    for (std::size_t j = 0; j < 4; ++j) {
      const double value = rows[i][j].get<double>();
      if (!(std::abs(value) <= double{std::numeric_limits<float>::max()}))
        fail(key, "contains a number that does not fit into a float");
      transform[4 * i + j] = static_cast<float>(value);
      if (j < 3) rotation[i][j] = value;
    }
  if (!is_rotation(rotation))
    fail(key,
         "does not begin with a rotation (rows orthonormal within 1e-4, determinant 1); check the calibration, its "
         "order of rows and columns, and that the length unit is not scaled into it");
  return transform;
}

/// The message without its prefix "[json.exception.parse_error.101] ".
std::string reason(const Json::exception& error) {
  const std::string text = error.what();
  const std::size_t end = text.find("] ");
  return text.starts_with('[') && end != std::string::npos ? text.substr(end + 2) : text;
}

Json parse(std::string_view text, const std::filesystem::path& path) {
  try {
    return Json::parse(text);
  } catch (const Json::exception& error) {
    throw Error(Status::bad_input, path.string() + " is not JSON: " + reason(error));
  }
}

bake::StereoSensor read_sensor(const JsonTable& file) {
  const JsonTable table = file.table("sensor");
  table.refuse_unknown_keys({"axes", "focal_px", "width_px", "height_px", "T_reference_right"});
  bake::StereoSensor sensor;
  sensor.T_reference_sensor = file.pose("T_reference_sensor");
  sensor.T_reference_right = table.pose("T_reference_right");
  sensor.focal_px = static_cast<float>(table.number("focal_px", 1, 1e6));
  sensor.width_px = table.pixels("width_px");
  sensor.height_px = table.pixels("height_px");
  return sensor;
}

std::string read_length_unit(const JsonTable& file) {
  std::string name = SensorDescription{}.length_unit;
  if (const Json* unit = file.find("length_unit")) {
    if (!unit->is_string() || unit->get<std::string>().empty()) file.fail("length_unit", "needs text, like \"mm\"");
    name = unit->get<std::string>();
  }
  if (std::ranges::find(length_units, name, &LengthUnit::name) == length_units.end())
    file.fail("length_unit", "cannot be \"" + name + "\"; give mm, cm, m, um, in or ft");
  return name;
}

/// wanted: empty for any.
void require_unit(const JsonTable& file, const std::string& unit, std::string_view wanted) {
  if (!wanted.empty() && unit != wanted)
    file.fail("length_unit", "is \"" + unit + "\", but the model's lengths are in \"" + std::string(wanted) +
                                 "\"; convert the poses, or correct the unit (without one it is mm)");
}

bake::SensingNoise read_noise(const JsonTable& file, const std::string& length_unit) {
  bake::SensingNoise noise;
  const double scale = units_per_mm(length_unit);
  noise.sigma = static_cast<float>(double{noise.sigma} * scale);
  const double most = double{std::numeric_limits<float>::max()};
  if (file.find("noise") != nullptr && file.find("noise_mm") != nullptr)
    file.fail("noise", "and \"noise_mm\" are both there; keep one");
  file.read("noise", noise.sigma, 0, most);
  if (file.find("noise_mm") != nullptr) noise.sigma = static_cast<float>(file.number("noise_mm", 0, most) * scale);
  file.read("outliers", noise.outliers, 0, 1);
  file.read("min_cos_incidence", noise.min_cos_incidence, 0, 1);
  file.read("dropout", noise.dropout, 0, 1);
  file.read("background", noise.background, 0, most);
  return noise;
}

}  // namespace

SensorDescription read_sensor_json(const std::filesystem::path& path, std::string_view length_unit) {
  return parse_sensor_json(as_text(read_file(path)), path, length_unit);
}

SensorDescription parse_sensor_json(std::string_view text, const std::filesystem::path& name,
                                    std::string_view length_unit) {
  const Json json = parse(text, name);
  const JsonTable file(json, name);
  file.refuse_unknown_keys({"length_unit", "T_reference_sensor", "sensor", "noise", "noise_mm", "outliers",
                            "min_cos_incidence", "dropout", "background", "comment"});
  SensorDescription description;
  description.length_unit = read_length_unit(file);
  description.sensor = read_sensor(file);
  description.noise = read_noise(file, description.length_unit);
  require_unit(file, description.length_unit, length_unit);
  return description;
}

RigidTransform read_pose(const std::filesystem::path& path, std::string_view length_unit) {
  const Json json = parse(as_text(read_file(path)), path);
  const JsonTable file(json, path);
  if (!length_unit.empty()) require_unit(file, read_length_unit(file), length_unit);  // else it may be unknown
  return file.pose("T_reference_sensor");
}

}  // namespace lbea::io
