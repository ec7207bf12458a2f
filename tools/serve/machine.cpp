#include "tools/serve/machine.hpp"

#include "adapters/files/system_files.hpp"
#include "tools/serve/system.hpp"
#include "tools/shared/text/formatted.hpp"

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <cstring>
#include <thread>

#include <unistd.h>

namespace lbea::tool {
namespace {

using Level = Finding::Level;
constexpr double mb = 1e6;

std::string fixed(double value, int digits) { return formatted("%.*f", digits, value); }

/// A temporary file, removed at once where the system can, otherwise on destruction.
struct ProbeFile {
  explicit ProbeFile(const std::filesystem::path& folder) {
    const std::string start = ".lbea-check-" + std::to_string(io::system::process_id()) + "-";
    for (int i = 0; i < 1000 && descriptor < 0; ++i) {
      name = folder / (start + std::to_string(i));
      descriptor = io::system::create_file(name);
      if (descriptor < 0 && errno != EEXIST) return;
    }
    if (descriptor >= 0) io::system::remove_file(name);
  }
  ~ProbeFile() {
    if (descriptor < 0) return;
    ::close(descriptor);
    io::system::remove_file(name);
  }
  ProbeFile(const ProbeFile&) = delete;
  ProbeFile& operator=(const ProbeFile&) = delete;
  std::filesystem::path name;
  int descriptor = -1;
};

struct WriteProbe {
  double mb_per_s = 0;
  double longest_ms = 0;
  int error = 0;
};

WriteProbe probe_writing(int descriptor, std::uint64_t bytes) {
  using Clock = std::chrono::steady_clock;
  const std::vector<std::byte> block(std::size_t{4} << 20, std::byte{0x5a});
  WriteProbe probe;
  const auto begin = Clock::now();
  for (std::uint64_t done = 0; done < bytes;) {
    const auto before = Clock::now();
    const auto count = static_cast<std::size_t>(std::min<std::uint64_t>(block.size(), bytes - done));
    const std::int64_t written = io::system::write_some(descriptor, std::span(block).first(count));
    if (written <= 0) return {0, 0, errno};
    done += static_cast<std::uint64_t>(written);
    probe.longest_ms =
        std::max(probe.longest_ms, std::chrono::duration<double, std::milli>(Clock::now() - before).count());
  }
  if (const int error = io::system::flush(descriptor); error != 0) return {0, 0, error};
  probe.mb_per_s = static_cast<double>(bytes) / mb / std::chrono::duration<double>(Clock::now() - begin).count();
  return probe;
}

std::string whole_mb(std::uint64_t bytes) { return std::to_string(bytes / 1'000'000); }

}  // namespace

std::vector<Finding> request_for_thread(const PrivilegeRequest& request, std::uint32_t matcher) {
  std::vector<Finding> answers;
  if (request.pin) answers.push_back(system::pin(*request.pin + matcher));
  if (request.realtime) answers.push_back(system::become_realtime(*request.realtime));
  return answers;
}

std::vector<Finding> request_for_process(const PrivilegeRequest& request, const Model* model, Method method) {
  if (!request.lock_memory) return {};
  return {system::lock_memory(model, method)};
}

Finding check_memory(std::uint64_t needed) {
  const std::uint64_t available = system::available_memory();
  const std::string text = "needs " + whole_mb(needed) + " MB of " + whole_mb(available) + " MB free";
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
  for (Finding& finding : system::check_governor()) findings.push_back(std::move(finding));
  return findings;
}

Finding check_disk(const std::filesystem::path& folder, std::uint64_t bytes) {
  constexpr double frame_mb = 0.75;  // 62,000 points
  const ProbeFile file(folder);
  if (file.descriptor < 0)
    return {"disk", Level::failed,
            folder.string() + ": cannot be written to (" + std::strerror(errno) + "); record elsewhere"};
  std::error_code unknown;
  const std::uintmax_t free = std::filesystem::space(folder, unknown).available;
  const double free_mb = unknown ? 0 : static_cast<double>(free) / mb;
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
