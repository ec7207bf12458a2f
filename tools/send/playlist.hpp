// The clouds to send, encoded before the first one is sent, so that the pace depends only on the clock.
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
  std::optional<std::int64_t> stamp_ns;  // none without one in table, file or file name
};

/// Reads and encodes. Stamps come from the table `stamps` or, when it is empty, from stamps.csv beside the clouds;
/// otherwise from the clouds, otherwise from their file names. `columns` as in read_point_cloud(). `progress` is called
/// with the number done. Throws what read_point_cloud throws, and Error{bad_input} for a stamp outside the wire
/// format's range.
[[nodiscard]] std::vector<EncodedCloud> encode_clouds(const std::vector<std::filesystem::path>& files,
                                                      const std::filesystem::path& stamps, const std::string& columns,
                                                      std::uint64_t session, const std::string& frame_id,
                                                      const std::function<void(std::size_t)>& progress);

/// Due times by the clouds' stamps, in ns after the first cloud: one per cloud, then one for the second round's first.
/// Throws Error{bad_input} when a cloud has no stamp or an earlier one than its predecessor.
[[nodiscard]] std::vector<std::int64_t> schedule_by_stamps(const std::vector<EncodedCloud>& clouds);
/// The same at a constant rate `rate_hz` > 0.
[[nodiscard]] std::vector<std::int64_t> schedule_by_rate(std::size_t clouds, double rate_hz);

}  // namespace lbea::tool
