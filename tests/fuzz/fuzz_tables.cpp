// Arbitrary bytes as one of the small configuration files; the first byte chooses which. Refused with a message, or
// read.
#include "adapters/clouds/point_cloud.hpp"
#include "adapters/ensemble/ensemble_toml.hpp"
#include "adapters/rig/sensor_json.hpp"
#include "adapters/wire/access/keys.hpp"
#include "tests/fuzz/memory_file.hpp"

#include <lbea/lbea.hpp>

#include <cmath>
#include <cstdlib>
#include <string_view>

namespace {

void require(bool holds) {
  if (!holds) std::abort();
}

void read(char kind, const std::filesystem::path& file, std::string_view content) {
  using namespace lbea;
  using namespace lbea::bake;
  using namespace lbea::io;
  using namespace lbea::wire;
  switch (kind) {
    case 's':
      static_cast<void>(CloudStamps(file).of("cloud_0001.ply", 3));
      break;
    case 'n':
      static_cast<void>(stamp_in_name(content));
      break;
    case 'p': {
      const ParameterTable table = read_parameters_csv(file);
      require(table.values.size() == table.runs.size() * table.names.size() &&
              table.units.size() == table.names.size());
      break;
    }
    case 'i':
      require(!read_node_ids(file).empty());
      break;
    case 'j': {
      const SensorDescription description = read_sensor_json(file);
      for (const float entry : description.sensor.T_reference_sensor) require(std::isfinite(entry));
      break;
    }
    case 'k':
      require(read_key_pair(file).secret_key.size() == 40);
      break;
    case 'a':
      require(!read_public_keys(file).empty());
      break;
    default:
      static_cast<void>(read_pose(file));
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size == 0) return 0;
  static const lbea::fuzz::MemoryFile file;
  file.put({data + 1, size - 1});
  try {
    read(static_cast<char>(data[0]), file.path(), {reinterpret_cast<const char*>(data + 1), size - 1});
  } catch (const lbea::Error& error) { require(error.what()[0] != '\0'); }
  return 0;
}
