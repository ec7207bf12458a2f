#include "tools/serve/machine.hpp"

#include "tools/shared/cli/formatted.hpp"

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <cstring>
#include <fstream>
#include <thread>

#include <fcntl.h>
#include <pthread.h>
#include <sched.h>
#include <sys/mman.h>
#include <sys/resource.h>
#include <sys/statvfs.h>
#include <sys/timex.h>
#include <unistd.h>

namespace lbea::tool {
namespace {

using Level = Finding::Level;
constexpr std::uint64_t mb = 1'000'000;
constexpr rlim_t max_descriptors = 16'384;  // an unknown connection takes memory for two seconds

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

std::string first_line(const char* file) {
  std::ifstream in(file);
  std::string line;
  std::getline(in, line);
  return line;
}

std::string fixed(double value, int digits) { return formatted("%.*f", digits, value); }

std::uint64_t available_memory() {
  std::ifstream in("/proc/meminfo");
  std::string name;
  for (std::uint64_t kb = 0; in >> name >> kb; in.ignore(64, '\n'))
    if (name == "MemAvailable:") return kb * 1024;
  return 0;
}

/// A temporary file, removed on destruction.
struct ProbeFile {
  explicit ProbeFile(const std::filesystem::path& folder) : name((folder / ".lbea-check-XXXXXX").string()) {
    descriptor = ::mkostemp(name.data(), O_CLOEXEC);
    if (descriptor >= 0) ::unlink(name.c_str());
  }
  ~ProbeFile() {
    if (descriptor >= 0) ::close(descriptor);
  }
  std::string name;
  int descriptor = -1;
};

struct WriteProbe {
  double mb_per_s = 0;
  double longest_ms = 0;
  int error = 0;
};

WriteProbe probe_writing(int descriptor, std::uint64_t bytes) {
  using Clock = std::chrono::steady_clock;
  const std::vector<char> block(std::size_t{4} << 20, '\x5a');
  WriteProbe probe;
  const auto begin = Clock::now();
  for (std::uint64_t done = 0; done < bytes;) {
    const auto before = Clock::now();
    const ssize_t written = ::write(descriptor, block.data(), std::min<std::uint64_t>(block.size(), bytes - done));
    if (written <= 0) return {0, 0, errno};
    done += static_cast<std::uint64_t>(written);
    probe.longest_ms =
        std::max(probe.longest_ms, std::chrono::duration<double, std::milli>(Clock::now() - before).count());
  }
  if (::fdatasync(descriptor) != 0) return {0, 0, errno};
  probe.mb_per_s = static_cast<double>(bytes) / static_cast<double>(mb) /
                   std::chrono::duration<double>(Clock::now() - begin).count();
  return probe;
}

}  // namespace

std::vector<Finding> request_for_thread(const PrivilegeRequest& request, std::uint32_t matcher) {
  std::vector<Finding> answers;
  if (request.pin) answers.push_back(pin(*request.pin + matcher));
  if (request.realtime) answers.push_back(become_realtime(*request.realtime));
  return answers;
}

std::vector<Finding> request_for_process(const PrivilegeRequest& request, const Model* model, Method method) {
  if (!request.lock_memory) return {};
  return {lock_memory(model, method)};
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
                    "synchronized, within " + fixed(static_cast<double>(time.maxerror) * 1e-3, 1) + " ms"}
          : Finding{"clock", Level::warning, "not synchronized (NTP, PTP): stamps of two machines cannot be compared"});
  const std::string source = first_line("/sys/devices/system/clocksource/clocksource0/current_clocksource");
  if (source == "hpet" || source == "acpi_pm")
    findings.push_back({"clock source", Level::warning, source + " is slow to read; prefer tsc"});
  return findings;
}

Finding check_memory(std::uint64_t needed) {
  const std::uint64_t available = available_memory();
  const std::string text =
      "needs " + std::to_string(needed / mb) + " MB of " + std::to_string(available / mb) + " MB free";
  if (needed > available)
    return {"memory", Level::failed, text + "; lower --queue, --max-points or the recording's ring"};
  return {"memory", needed > available / 2 ? Level::warning : Level::ok, text};
}

std::vector<Finding> check_privileges(const PrivilegeRequest& request, std::uint32_t matchers, const Model* model,
                                      Method method) {
  std::vector<Finding> findings;
  for (std::uint32_t i = 0; i < matchers; ++i)
    std::thread([&] {
      for (Finding& finding : request_for_thread(request, i)) findings.push_back(std::move(finding));
    }).join();
  for (Finding& finding : request_for_process(request, model, method)) findings.push_back(std::move(finding));
  if (findings.empty())
    findings.push_back({"privileges", Level::ok, "none requested (--pin, --realtime, --lock-memory)"});
  const std::string governor = first_line("/sys/devices/system/cpu/cpu0/cpufreq/scaling_governor");
  if (!governor.empty() && governor != "performance")
    findings.push_back({"governor", Level::warning,
                        "processors reduce their clock when idle (" + governor + "); set it to performance"});
  return findings;
}

Finding check_disk(const std::filesystem::path& folder, std::uint64_t bytes) {
  constexpr double frame_mb = 0.75;  // 62,000 points
  const ProbeFile file(folder);
  if (file.descriptor < 0)
    return {"disk", Level::failed,
            folder.string() + ": cannot be written to (" + std::strerror(errno) + "); record elsewhere"};
  struct statvfs space {};
  ::fstatvfs(file.descriptor, &space);
  const double free_mb =
      static_cast<double>(space.f_bavail) * static_cast<double>(space.f_frsize) / static_cast<double>(mb);
  const WriteProbe probe = probe_writing(file.descriptor, bytes);
  if (probe.error != 0)
    return {"disk", Level::failed,
            folder.string() + ": writing failed (" + std::strerror(probe.error) + "); free space or record elsewhere"};
  const std::string text = folder.string() + ": " + fixed(probe.mb_per_s, 0) + " MB/s, enough for " +
                           fixed(probe.mb_per_s / frame_mb, 0) + " frames/s of 62,000 points; longest stall " +
                           fixed(probe.longest_ms, 0) + " ms; " + fixed(free_mb, 0) + " MB free";
  return {"disk", free_mb < 10 * probe.mb_per_s ? Level::warning : Level::ok, text};
}

}  // namespace lbea::tool
