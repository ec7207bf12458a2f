#include "precompute/jobs/archive.hpp"

#include "runtime/src/model/checksum.hpp"

namespace lbea::bake {

void KeySink::bytes(std::span<const std::byte> bytes) { key_ = XXH3_64bits_withSeed(bytes.data(), bytes.size(), key_); }

}  // namespace lbea::bake
