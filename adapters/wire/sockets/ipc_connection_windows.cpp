// Windows has no ipc endpoints.
#include "adapters/wire/sockets/ipc_connection.hpp"

namespace lbea::wire::detail {
bool enlarge_send_buffer(int, const std::string&, int) noexcept { return false; }
bool has_unread_bytes(int, const std::string&) noexcept { return false; }
}  // namespace lbea::wire::detail
