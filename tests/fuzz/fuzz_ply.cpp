#include "adapters/clouds/point_cloud.hpp"

#include <cstdlib>

namespace lbea::io {
ParseCloud parse_ply;
}

// Any bytes give a cloud the bytes can hold, or an Error with a sentence.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  try {
    const auto cloud = lbea::io::parse_ply(std::as_bytes(std::span(data, size)), "fuzz.ply");
    if (cloud.points.size() > size) std::abort();
  } catch (const lbea::Error& error) {
    if (error.what()[0] == '\0') std::abort();
  }
  return 0;
}
