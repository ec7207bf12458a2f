// The last line of a program.
#pragma once

#include <string>

namespace lbea::tool {

/// Prints the last line of a program to standard output. Waits for a reader for at most half a second; a line that
/// cannot be written for another reason throws Error{write_failed}.
void print_last_line(const std::string& line);

}  // namespace lbea::tool
