// Output to a terminal, pipe, socket or file that perhaps nobody reads.
#pragma once

#include <functional>
#include <string>
#include <string_view>

#include <sys/types.h>

namespace lbea::tool {

class Outlet {
 public:
  /// The descriptor stays open, and its flags, which other programs share, stay as they are.
  explicit Outlet(int descriptor);
  ~Outlet();
  Outlet(const Outlet&) = delete;
  Outlet& operator=(const Outlet&) = delete;
  /// Whether all of `text` was written; errno is set when not. Without a reader it waits until `gives_up` returns true.
  bool write(std::string_view text, const std::function<bool()>& gives_up) const;

 private:
  [[nodiscard]] ssize_t write_some(std::string_view text) const noexcept;

  bool is_socket_;
  int descriptor_;
};

/// Prints the last line of a program to standard output. Waits for a reader for at most half a second; a line that
/// cannot be written for another reason throws Error{write_failed}.
void print_last_line(const std::string& line);

}  // namespace lbea::tool
