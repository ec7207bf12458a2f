#include "tools/shared/system/trigger_signal.hpp"

#include <csignal>

namespace lbea::tool {
namespace {
volatile std::sig_atomic_t trigger_requested = 0;
}

const char* trigger_signal_text() noexcept { return "SIGUSR1 or "; }
bool has_trigger_signal() noexcept { return true; }

void catch_trigger_signal() {
  std::signal(SIGUSR1, [](int) { trigger_requested = 1; });
}

bool take_trigger_signal() noexcept {
  if (trigger_requested == 0) return false;
  trigger_requested = 0;
  return true;
}

}  // namespace lbea::tool
