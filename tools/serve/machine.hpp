// Requests to the operating system, which may be denied, and checks of the machine before a test.
#pragma once

#include <lbea/lbea.hpp>

#include <optional>

namespace lbea::tool {

/// Optional: the program also runs without them.
struct PrivilegeRequest {
  std::optional<unsigned> pin;  // processor for the matching thread; for several: of the first, others follow
  std::optional<int> realtime;  // its SCHED_FIFO priority, 1 to 99
  bool lock_memory = false;  // present and future memory of the process, except parts of the model that no frame needs
};

/// The result of one check, or the answer to one request, which is never failed.
struct Finding {
  enum class Level { ok, warning, failed };
  std::string name;
  Level level = Level::ok;
  std::string text;
};

/// For the calling thread, which becomes a matching thread, by its number.
[[nodiscard]] std::vector<Finding> request_for_thread(const PrivilegeRequest& request, std::uint32_t matcher);
/// For the process, after it has opened its model (if any) and before it allocates much.
[[nodiscard]] std::vector<Finding> request_for_process(const PrivilegeRequest& request, const Model* model,
                                                       Method method);

/// Whether `needed` bytes of memory are free.
[[nodiscard]] Finding check_memory(std::uint64_t needed);
/// Makes each request in temporary threads or in this process.
[[nodiscard]] std::vector<Finding> check_privileges(const PrivilegeRequest& request, std::uint32_t matchers,
                                                    const Model* model, Method method);
/// Writes a temporary file of `bytes` bytes in `folder`: rate, longest stall, and free space.
[[nodiscard]] Finding check_disk(const std::filesystem::path& folder, std::uint64_t bytes);

}  // namespace lbea::tool
