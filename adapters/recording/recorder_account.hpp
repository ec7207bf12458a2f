// The recorder's own account, for the recording itself.
#pragma once

#include "adapters/recording/recorder.hpp"

#include <string>

namespace lbea {

/// What changes only when something was lost or the state changes, as one JSON object.
[[nodiscard]] std::string account_json(const RecorderStatus& status);
/// The JSON schema of that.
[[nodiscard]] std::string_view account_schema() noexcept;
/// The last record of the data: how many messages there should be.
[[nodiscard]] mcap::Metadata closing_metadata(const RecorderStatus& status);
inline constexpr std::string_view closing_metadata_name = "lbea.recording.end";

}  // namespace lbea
