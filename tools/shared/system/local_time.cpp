#include "tools/shared/system/local_time.hpp"

namespace lbea::tool {

std::string_view time_conversions() noexcept { return "%YCymBbhdejHIMSFTRpZzaAuwUWVGgs"; }

std::tm local_time(std::time_t time) noexcept {
  std::tm local{};
  ::localtime_r(&time, &local);
  return local;
}

}  // namespace lbea::tool
