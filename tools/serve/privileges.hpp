// What the kernel grants only to some: a processor of one's own, precedence, memory that stays. Asked for, reported,
// never a reason not to run.
#pragma once

#include <lbea/lbea.hpp>

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace lbea::tool {

struct PrivilegeRequest {
  std::optional<unsigned> pin;  // processor for the matching thread
  std::optional<int> realtime;  // its SCHED_FIFO priority, 1 to 99
  bool lock_memory = false;     // of the whole process, present and future, but for what no frame needs of the model
};

struct Privilege {
  std::string name;  // "pin", "realtime", "lock-memory"
  bool granted = false;
  std::string detail;  // what was granted; or why not, and what to do
};

/// For the calling thread, which is to be the matching one.
[[nodiscard]] std::vector<Privilege> ask_for_thread(const PrivilegeRequest& request);
/// For the process, after it has opened its model (if any), and before it allocates much.
[[nodiscard]] std::vector<Privilege> ask_for_process(const PrivilegeRequest& request, const Model* model,
                                                     Method method);

/// Lets the process open as many descriptors as it may: strangers who knock must not use up what peers need.
void raise_descriptor_limit() noexcept;

}  // namespace lbea::tool
