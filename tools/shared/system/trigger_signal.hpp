// What triggers a recording with a window, apart from the frames' stamps.
#pragma once

namespace lbea::tool {

/// For --help: "SIGUSR1 or ", or empty where there is no such signal.
[[nodiscard]] const char* trigger_signal_text() noexcept;
[[nodiscard]] bool has_trigger_signal() noexcept;
void catch_trigger_signal();
/// Whether the signal came since the last call.
[[nodiscard]] bool take_trigger_signal() noexcept;

}  // namespace lbea::tool
