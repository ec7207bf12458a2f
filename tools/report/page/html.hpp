// Text for HTML and SVG. What comes from recordings, models and file names must pass through escaped().
#pragma once

#include "adapters/export/png.hpp"

#include <string>
#include <string_view>

namespace lbea::tool {

/// Without markup: & < > " ' as entities, control characters and bytes that are not UTF-8 as "\x1b" and the like.
[[nodiscard]] std::string escaped(std::string_view text);
/// With so many significant digits, without an exponent where it is readable; a dash for a number that is not finite.
[[nodiscard]] std::string number_text(double value, int digits = 3);
/// "8.93 ± 0.41": with the decimals that the half width needs.
[[nodiscard]] std::string interval_text(double value, double half_width);
/// "97 %"; "more than 99 %" and "less than 1 %" instead of 100 and 0; a dash for a number that is not finite.
[[nodiscard]] std::string percent_text(double share);
/// A cell, or a column's head, of a table of numbers. `html`: markup.
[[nodiscard]] std::string number_cell(const std::string& html);
[[nodiscard]] std::string number_head(const std::string& html);
/// The text as one word of a shell command.
[[nodiscard]] std::string shell_word(std::string_view text);
/// The picture as the value of src or href.
[[nodiscard]] std::string data_url(const io::Picture& picture);

}  // namespace lbea::tool
