// What a recording without a matcher says at its end of who sent: also of captures that never came.
#pragma once

#include "adapters/mcap/mcap_records.hpp"
#include "adapters/wire/codec/messages.hpp"

#include <vector>

namespace lbea::tool {

/// The metadata record of that name: a text for each session, its number hexadecimal, with first_id, next_id, received,
/// missed, withheld, condition.
inline constexpr std::string_view senders_metadata_name = "lbea.recording.senders";
[[nodiscard]] mcap::Metadata to_metadata(const std::vector<wire::WireSender>& senders);
/// What is no sender's account is left out.
[[nodiscard]] std::vector<wire::WireSender> senders_from(const mcap::Metadata& metadata);

}  // namespace lbea::tool
