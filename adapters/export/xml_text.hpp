// Text and numbers as XML wants them.
#pragma once

#include <string>
#include <string_view>

namespace lbea::io {

/// `text` between quotes: & < > " escaped.
/// Throws Error{bad_config} for control characters, which XML cannot hold.
[[nodiscard]] std::string xml_quoted(std::string_view text);

/// The shortest decimal that reads back as the same double.
[[nodiscard]] std::string xml_number(double value);

}  // namespace lbea::io
