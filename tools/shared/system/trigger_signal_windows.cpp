// Windows has no signals for this.
#include "tools/shared/system/trigger_signal.hpp"

namespace lbea::tool {

const char* trigger_signal_text() noexcept { return ""; }
bool has_trigger_signal() noexcept { return false; }
void catch_trigger_signal() {}
bool take_trigger_signal() noexcept { return false; }

}  // namespace lbea::tool
