// Windows has no ipc endpoints.
#include "adapters/wire/bound/bound_endpoint.hpp"

namespace lbea::wire {
EndpointLock::EndpointLock(const Endpoint&) {}
EndpointLock::~EndpointLock() = default;
EndpointLock::EndpointLock(EndpointLock&&) noexcept = default;
EndpointLock& EndpointLock::operator=(EndpointLock&&) noexcept = default;
bool EndpointLock::is_held() const noexcept { return false; }
void EndpointLock::restrict_to_owner(const Endpoint&) noexcept {}
void EndpointLock::remove_socket(const Endpoint&) const noexcept {}
}  // namespace lbea::wire
