// The kernel's buffers of an ipc connection. The descriptor of a connection that is already closed may be that of
// another file: both functions check that it leads to `path`.
#pragma once

#include <string>

namespace lbea::wire::detail {
/// False when the descriptor does not lead to `path`.
bool enlarge_send_buffer(int connection, const std::string& path, int wanted_bytes) noexcept;
/// Whether the other end has yet to read something.
[[nodiscard]] bool has_unread_bytes(int connection, const std::string& path) noexcept;
}  // namespace lbea::wire::detail
