#include "tools/serve/system.hpp"

#include "tools/shared/text/formatted.hpp"

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <fstream>

#include <pthread.h>
#include <sched.h>
#include <sys/mman.h>
#include <sys/resource.h>
#include <sys/timex.h>

namespace lbea::tool::system {
namespace {

using Level = Finding::Level;
constexpr std::uint64_t mb = 1'000'000;
constexpr rlim_t max_descriptors = 16'384;  // an unknown connection takes memory for two seconds
constexpr rlim_t recommended_descriptors = 4096;

// Existing memory is locked when it is first used; locking it at once would read the whole model. Memory allocated
// later is locked immediately.
bool lock_all(const Model* model, Method method) {
  return ::mlockall(MCL_CURRENT | MCL_FUTURE | MCL_ONFAULT) == 0 && (model == nullptr || model->lock(method)) &&
         ::mlockall(MCL_FUTURE) == 0;
}

std::string describe(const Model* model, Method method) {
  if (model == nullptr || model->hot_bytes(method) == model->bytes()) return "all memory stays in RAM";
  return "all memory stays in RAM; of the model " + std::to_string(model->hot_bytes(method) / mb) + " MB, the other " +
         std::to_string((model->bytes() - model->hot_bytes(method)) / mb) + " MB are read on demand";
}

std::string first_line(const char* file) {
  std::ifstream in(file);
  std::string line;
  std::getline(in, line);
  return line;
}

}  // namespace

const char* realtime_text() noexcept { return "SCHED_FIFO priority for the matching threads"; }
const char* lock_text() noexcept { return "lock all memory in RAM"; }

Finding pin(unsigned processor) {
  cpu_set_t set;
  CPU_ZERO(&set);
  if (processor < CPU_SETSIZE) CPU_SET(processor, &set);
  const int error = processor < CPU_SETSIZE ? ::pthread_setaffinity_np(::pthread_self(), sizeof set, &set) : EINVAL;
  const std::string which = "processor " + std::to_string(processor);
  if (error == 0) return {"pin", Level::ok, "the matching thread runs on " + which};
  return {"pin", Level::warning,
          which + " is not available (" + std::strerror(error) + "); taskset -cp $$ lists those that are"};
}

Finding become_realtime(int priority) {
  sched_param param{};
  param.sched_priority = priority;
  const int error = ::pthread_setschedparam(::pthread_self(), SCHED_FIFO, &param);
  const std::string which = "SCHED_FIFO priority " + std::to_string(priority);
  if (error == 0) return {"realtime", Level::ok, "the matching thread has " + which};
  return {"realtime", Level::warning,
          which + " was denied (" + std::strerror(error) +
              "); allow it with LimitRTPRIO= in the unit, rtprio in limits.conf, or CAP_SYS_NICE"};
}

Finding lock_memory(const Model* model, Method method) {
  if (lock_all(model, method)) return {"lock-memory", Level::ok, describe(model, method)};
  const int error = errno;
  rlimit limit{};
  ::getrlimit(RLIMIT_MEMLOCK, &limit);
  return {"lock-memory", Level::warning,
          std::string("memory could not be locked (") + std::strerror(error) + "; the limit is " +
              std::to_string(limit.rlim_cur >> 20) +
              " MB); allow it with LimitMEMLOCK=infinity in the unit or memlock in limits.conf"};
}

void raise_descriptor_limit() noexcept {
  rlimit limit{};
  if (::getrlimit(RLIMIT_NOFILE, &limit) != 0) return;
  limit.rlim_cur = std::min(limit.rlim_max, max_descriptors);
  ::setrlimit(RLIMIT_NOFILE, &limit);
}

std::vector<Finding> check_clock() {
  std::vector<Finding> findings;
  timex time{};
  const int state = ::adjtimex(&time);
  const bool is_kept = state >= 0 && state != TIME_ERROR && (time.status & STA_UNSYNC) == 0;
  findings.push_back(
      is_kept
          ? Finding{"clock", Level::ok,
                    "synchronized, within " + formatted("%.1f", static_cast<double>(time.maxerror) * 1e-3) + " ms"}
          : Finding{"clock", Level::warning, "not synchronized (NTP, PTP): stamps of two machines cannot be compared"});
  const std::string source = first_line("/sys/devices/system/clocksource/clocksource0/current_clocksource");
  if (source == "hpet" || source == "acpi_pm")
    findings.push_back({"clock source", Level::warning, source + " is slow to read; prefer tsc"});
  return findings;
}

std::vector<Finding> check_descriptors() {
  rlimit limit{};
  ::getrlimit(RLIMIT_NOFILE, &limit);
  const std::string text = std::to_string(limit.rlim_cur) + " may be open";
  if (limit.rlim_cur >= recommended_descriptors) return {{"descriptors", Level::ok, text}};
  return {{"descriptors", Level::warning,
           text + "; unknown connections could use them up, raise LimitNOFILE= or ulimit -n"}};
}

std::vector<Finding> check_governor() {
  const std::string governor = first_line("/sys/devices/system/cpu/cpu0/cpufreq/scaling_governor");
  if (governor.empty() || governor == "performance") return {};
  return {{"governor", Level::warning,
           "processors reduce their clock when idle (" + governor + "); set it to performance"}};
}

std::uint64_t available_memory() {
  std::ifstream in("/proc/meminfo");
  std::string name;
  for (std::uint64_t kb = 0; in >> name >> kb; in.ignore(64, '\n'))
    if (name == "MemAvailable:") return kb * 1024;
  return 0;
}

}  // namespace lbea::tool::system
