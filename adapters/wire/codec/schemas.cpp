#include "adapters/wire/codec/schemas.hpp"

#include "PointCloud_bfbs_generated.h"
#include "frame_bfbs_generated.h"
#include "result_bfbs_generated.h"
#include "state_bfbs_generated.h"

namespace lbea::wire {
namespace {
template <class Schema>
std::span<const std::byte> bytes_of() noexcept {
  return std::as_bytes(std::span{Schema::data(), Schema::size()});
}
}  // namespace

std::span<const std::byte> point_cloud_schema() noexcept { return bytes_of<foxglove::PointCloudBinarySchema>(); }
std::span<const std::byte> frame_schema() noexcept { return bytes_of<schema::FrameBinarySchema>(); }
std::span<const std::byte> result_schema() noexcept { return bytes_of<schema::ResultBinarySchema>(); }
std::span<const std::byte> state_schema() noexcept { return bytes_of<schema::StateBinarySchema>(); }

}  // namespace lbea::wire
