// An MCAP file as the conformance suite's JSON lists it.
#pragma once

#include "adapters/mcap/reader.hpp"

#include <nlohmann/json.hpp>

#include <filesystem>

namespace lbea::test {

using namespace lbea::mcap;

/// Every record in order: chunks expanded, without message indexes, numbers as text, fields by name.
[[nodiscard]] nlohmann::json list_records(const mcap::ByteSource& source);

/// All pairs X.mcap, X.json below `folder` are compared and checked. Returns their number.
std::size_t check_conformance(const std::filesystem::path& folder);

}  // namespace lbea::test
