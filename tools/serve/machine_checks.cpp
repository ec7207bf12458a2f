// The parts of the preflight that look at the machine.
#include "tools/serve/preflight.hpp"

#include <lbea/lbea.hpp>

#include <algorithm>
#include <array>
#include <chrono>
#include <cstdio>
#include <cstring>
#include <fstream>
#include <thread>

#include <fcntl.h>
#include <sys/statvfs.h>
#include <sys/timex.h>
#include <unistd.h>

namespace lbea::tool {
namespace {

using Level = Finding::Level;
constexpr std::uint64_t mb = 1'000'000;

std::string first_line(const char* file) {
  std::ifstream in(file);
  std::string line;
  std::getline(in, line);
  return line;
}

std::string fixed(double value, int digits) {
  std::array<char, 32> text;
  std::snprintf(text.data(), text.size(), "%.*f", digits, value);
  return text.data();
}

std::uint64_t available_memory() {
  std::ifstream in("/proc/meminfo");
  std::string name;
  for (std::uint64_t kb = 0; in >> name >> kb; in.ignore(64, '\n'))
    if (name == "MemAvailable:") return kb * 1024;
  return 0;
}

/// A file that is gone when this is.
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

std::vector<Finding> check_clock() {
  std::vector<Finding> findings;
  timex time{};
  const int state = ::adjtimex(&time);
  const bool is_kept = state >= 0 && state != TIME_ERROR && (time.status & STA_UNSYNC) == 0;
  findings.push_back(is_kept
                         ? Finding{"clock", Level::ok,
                                   "kept right, within " + fixed(static_cast<double>(time.maxerror) * 1e-3, 1) + " ms"}
                         : Finding{"clock", Level::warning,
                                   "nobody keeps it right (NTP, PTP): stamps of two machines cannot be compared"});
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

std::vector<Finding> check_privileges(const PrivilegeRequest& request, const Model* model, Method method) {
  std::vector<Privilege> answers;
  std::thread([&] { answers = ask_for_thread(request); }).join();
  for (Privilege& answer : ask_for_process(request, model, method)) answers.push_back(std::move(answer));
  std::vector<Finding> findings;
  for (const Privilege& answer : answers)
    findings.push_back({answer.name, answer.granted ? Level::ok : Level::warning, answer.detail});
  if (findings.empty())
    findings.push_back({"privileges", Level::ok, "none asked for (--pin, --realtime, --lock-memory)"});
  const std::string governor = first_line("/sys/devices/system/cpu/cpu0/cpufreq/scaling_governor");
  if (!governor.empty() && governor != "performance")
    findings.push_back(
        {"governor", Level::warning, "processors slow down when idle (" + governor + "); set it to performance"});
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
            folder.string() + ": writing failed (" + std::strerror(probe.error) + "); make room or record elsewhere"};
  const std::string text = folder.string() + ": " + fixed(probe.mb_per_s, 0) + " MB/s, enough for " +
                           fixed(probe.mb_per_s / frame_mb, 0) + " frames/s of 62,000 points; longest stall " +
                           fixed(probe.longest_ms, 0) + " ms; " + fixed(free_mb, 0) + " MB free";
  return {"disk", free_mb < 10 * probe.mb_per_s ? Level::warning : Level::ok, text};
}

}  // namespace lbea::tool
