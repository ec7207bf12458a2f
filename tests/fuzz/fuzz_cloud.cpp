#include "adapters/clouds/point_cloud.hpp"

#include <cstdlib>

// Arbitrary bytes of any cloud format give a cloud of plausible size or an Error with a message. Compressed clouds can
// have more points than bytes: three bytes can encode 264.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  try {
    const auto cloud = lbea::io::parse_point_cloud(std::as_bytes(std::span(data, size)), "fuzz");
    if (cloud.points.size() > 100 * size) std::abort();
  } catch (const lbea::Error& error) {
    if (error.what()[0] == '\0') std::abort();
  }
  return 0;
}
