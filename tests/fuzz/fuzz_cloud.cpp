#include "adapters/clouds/point_cloud.hpp"

#include <cstdlib>

// Any bytes of any format give a cloud the bytes can hold, or an Error with a sentence. Packed clouds hold more points
// than bytes: three bytes may stand for 264.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  try {
    const auto cloud = lbea::io::parse_point_cloud(std::as_bytes(std::span(data, size)), "fuzz");
    if (cloud.points.size() > 100 * size) std::abort();
  } catch (const lbea::Error& error) {
    if (error.what()[0] == '\0') std::abort();
  }
  return 0;
}
