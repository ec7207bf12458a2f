#include "adapters/clouds/point_cloud.hpp"

#include <cstdlib>

namespace lbea::io {
ParseCloud parse_ply;
}

// Arbitrary bytes give a cloud with at most one point per byte, or an Error with a message.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  try {
    const auto cloud = lbea::io::parse_ply(std::as_bytes(std::span(data, size)), "fuzz.ply");
    if (cloud.points.size() > size) std::abort();
  } catch (const lbea::Error& error) {
    if (error.what()[0] == '\0') std::abort();
  }
  return 0;
}
