// The clouds to send, encoded before the first one leaves, so that the pace depends on nothing but the clock.
#pragma once

#include "tools/shared/cli/cloud_files.hpp"

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace lbea::tool {

struct EncodedCloud {
  std::filesystem::path file;
  std::shared_ptr<std::vector<std::byte>> message;
  std::optional<std::int64_t> stamp_ns;  // nothing when neither table, file nor name have one
};

/// Reads and encodes. Stamps are those of the table `stamps` or, when it is empty, of a file stamps.csv beside the
/// clouds, else the clouds' own, else those in their names. `progress` is called with the number done. Throws what
/// read_point_cloud throws, and Error{bad_input} for a stamp that does not fit on the wire.
[[nodiscard]] std::vector<EncodedCloud> encode_clouds(const std::vector<std::filesystem::path>& files,
                                                      const std::filesystem::path& stamps, std::uint64_t session,
                                                      const std::string& frame_id,
                                                      const std::function<void(std::size_t)>& progress);

/// Due times in ns after the first cloud, one per cloud, then one for the second round's first: as the stamps
/// say. Throws Error{bad_input} when a cloud has no stamp or one before its predecessor's.
[[nodiscard]] std::vector<std::int64_t> schedule_by_stamps(const std::vector<EncodedCloud>& clouds);
/// The same, evenly at `rate_hz` > 0.
[[nodiscard]] std::vector<std::int64_t> schedule_by_rate(std::size_t clouds, double rate_hz);

}  // namespace lbea::tool
