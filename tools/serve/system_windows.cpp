#include "tools/serve/system.hpp"

#include <algorithm>

#define WIN32_LEAN_AND_MEAN
#include <windows.h>

#include <psapi.h>

namespace lbea::tool::system {
namespace {

using Level = Finding::Level;
constexpr std::size_t mb = 1'000'000;
constexpr std::size_t other_memory = 256 * mb;  // of the process beside its model

/// The system locks and keeps no more than the smallest working set of a process.
bool grow_working_set(std::size_t bytes) {
  const HANDLE process = ::GetCurrentProcess();
  PROCESS_MEMORY_COUNTERS memory{};
  if (::K32GetProcessMemoryInfo(process, &memory, sizeof memory) == 0) return false;
  const std::size_t least = memory.WorkingSetSize + bytes + other_memory;
  return ::SetProcessWorkingSetSizeEx(process, least, 2 * least,
                                      QUOTA_LIMITS_HARDWS_MIN_ENABLE | QUOTA_LIMITS_HARDWS_MAX_DISABLE) != 0;
}

}  // namespace

const char* realtime_text() noexcept {
  return "give the matching threads the highest priority below Windows' real-time class, whatever the number";
}
const char* lock_text() noexcept { return "keep in RAM what frames need of the model, and 256 MB of other memory"; }

Finding pin(unsigned processor) {
  const std::string which = "processor " + std::to_string(processor);
  const DWORD_PTR mask = processor < 8 * sizeof(DWORD_PTR) ? DWORD_PTR{1} << processor : 0;
  if (mask != 0 && ::SetThreadAffinityMask(::GetCurrentThread(), mask) != 0)
    return {"pin", Level::ok, "the matching thread runs on " + which};
  return {"pin", Level::warning, which + " is not available; Task Manager lists those that are"};
}

Finding become_realtime(int) {
  if (::SetThreadPriority(::GetCurrentThread(), THREAD_PRIORITY_TIME_CRITICAL) != 0)
    return {"realtime", Level::ok,
            "the matching thread has the highest priority below Windows' real-time class; the number has no meaning"};
  return {"realtime", Level::warning, "the highest priority was denied; start the program with more rights"};
}

Finding lock_memory(const Model* model, Method method) {
  const std::size_t bytes = model == nullptr ? 0 : static_cast<std::size_t>(model->hot_bytes(method));
  if (grow_working_set(bytes) && (model == nullptr || model->lock(method)))
    return {"lock-memory", Level::ok,
            std::to_string(bytes / mb) + " MB of the model and " + std::to_string(other_memory / mb) +
                " MB of other memory stay in RAM; Windows cannot lock all memory"};
  return {"lock-memory", Level::warning,
          "memory could not be locked; give the user the right to increase a process working set, or free memory"};
}

void raise_descriptor_limit() noexcept {}

std::vector<Finding> check_clock() {
  return {{"clock", Level::warning,
           "whether it is synchronized is not known: see w32tm /query /status; stamps of two machines can only be "
           "compared when both are"}};
}

std::vector<Finding> check_descriptors() { return {}; }
std::vector<Finding> check_governor() { return {}; }

std::uint64_t available_memory() {
  MEMORYSTATUSEX memory{};
  memory.dwLength = sizeof memory;
  ::GlobalMemoryStatusEx(&memory);
  return memory.ullAvailPhys;
}

}  // namespace lbea::tool::system
