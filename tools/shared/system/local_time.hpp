// Names with the local time in strftime's notation.
#pragma once

#include <ctime>
#include <string>
#include <string_view>

namespace lbea::tool {

/// The conversions of strftime, without those that produce slashes, line ends or, on Windows, text that depends on the
/// language or is not known there.
[[nodiscard]] std::string_view time_conversions() noexcept;
[[nodiscard]] std::tm local_time(std::time_t time) noexcept;

}  // namespace lbea::tool
