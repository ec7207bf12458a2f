#include "adapters/mcap/recorder_status.hpp"

#include <array>

namespace lbea::mcap {
namespace {
constexpr std::array<std::string_view, 4> state_names{"armed", "recording", "finished", "failed"};
}

std::string_view to_string(RecorderState state) noexcept { return state_names[static_cast<std::size_t>(state)]; }

}  // namespace lbea::mcap
