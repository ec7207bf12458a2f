// What lbea-serve asks of the operating system: one implementation per system. See machine.hpp.
#pragma once

#include "tools/serve/machine.hpp"

namespace lbea::tool::system {

/// For --help: what --realtime and --lock-memory do on this system.
[[nodiscard]] const char* realtime_text() noexcept;
[[nodiscard]] const char* lock_text() noexcept;

/// For the calling thread.
[[nodiscard]] Finding pin(unsigned processor);
[[nodiscard]] Finding become_realtime(int priority);
/// For the process, with `model` or null.
[[nodiscard]] Finding lock_memory(const Model* model, Method method);

/// Raises the process's limit of open descriptors to its maximum or 16,384, so that unknown connections use up neither
/// those that peers need nor memory. Windows has no such limit.
void raise_descriptor_limit() noexcept;

/// Whether the clock is synchronized, and fast to read.
[[nodiscard]] std::vector<Finding> check_clock();
/// Whether as many descriptors may be open as should be; nothing without a limit.
[[nodiscard]] std::vector<Finding> check_descriptors();
/// A warning when processors are slowed down while they wait; nothing when not, or when that is unknown.
[[nodiscard]] std::vector<Finding> check_governor();
/// Bytes that programs may still use.
[[nodiscard]] std::uint64_t available_memory();

}  // namespace lbea::tool::system
