// Windows has no systemd.
#include "tools/shared/system/service_notify.hpp"

namespace lbea::tool {

ServiceNotify::ServiceNotify() = default;
ServiceNotify::~ServiceNotify() = default;
void ServiceNotify::ready(const std::string&) const noexcept {}
void ServiceNotify::status(const std::string&) const noexcept {}
void ServiceNotify::alive() const noexcept {}
void ServiceNotify::stopping() const noexcept {}
void ServiceNotify::tell(const std::string&) const noexcept {}

}  // namespace lbea::tool
