// Text of models, recordings, files and peers, for terminals and logs.
#pragma once

#include <string>
#include <string_view>

namespace lbea::tool {

/// The text with its control characters as "\x1b" and the like, so that it cannot change the terminal or imitate other
/// lines: bytes below 32 except those in `kept`, delete, U+0080 to U+009F, marks of writing direction, and bytes that
/// are not UTF-8.
[[nodiscard]] std::string printable(std::string_view text, std::string_view kept = {});

}  // namespace lbea::tool
