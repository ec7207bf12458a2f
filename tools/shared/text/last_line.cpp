#include "tools/shared/text/last_line.hpp"

#include "tools/shared/text/outlet.hpp"

#include <lbea/lbea.hpp>

#include <cerrno>
#include <chrono>
#include <system_error>

#include <unistd.h>

namespace lbea::tool {

void print_last_line(const std::string& line) {
  constexpr auto longest_wait = std::chrono::milliseconds(500);
  const auto deadline = std::chrono::steady_clock::now() + longest_wait;
  const bool is_written =
      Outlet(STDOUT_FILENO).write(line + "\n", [&] { return std::chrono::steady_clock::now() > deadline; });
  if (!is_written && errno != EAGAIN && errno != EPIPE)
    throw Error(Status::write_failed, "cannot write to standard output: " + std::generic_category().message(errno));
}

}  // namespace lbea::tool
