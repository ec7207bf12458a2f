// The compiled schemas of the messages (.bfbs bytes), for recordings and viewers that decode by them.
#pragma once

#include <cstddef>
#include <span>

namespace lbea::wire {

[[nodiscard]] std::span<const std::byte> point_cloud_schema() noexcept;  // foxglove.PointCloud
[[nodiscard]] std::span<const std::byte> frame_schema() noexcept;        // lbea.wire.Frame
[[nodiscard]] std::span<const std::byte> result_schema() noexcept;       // lbea.wire.Result
[[nodiscard]] std::span<const std::byte> state_schema() noexcept;        // lbea.wire.State

}  // namespace lbea::wire
