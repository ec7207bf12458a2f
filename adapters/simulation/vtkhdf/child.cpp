#include "adapters/simulation/vtkhdf/child.hpp"

#include "adapters/files/atomic_file.hpp"

#include <lbea/lbea.hpp>

#include <algorithm>
#include <array>
#include <cerrno>
#include <csignal>
#include <new>
#include <optional>

#include <fcntl.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

namespace lbea::io::child {
namespace {
constexpr std::uint64_t least_seconds = 2,
                        bytes_per_second = 1'000'000;  // of processor time; far slower than any disk
constexpr std::byte has_result{'r'}, has_error{'e'}, has_no_memory{'m'};

/// Memory that both processes see.
class SharedMemory {
 public:
  SharedMemory() : descriptor_(::memfd_create("lbea", MFD_CLOEXEC)) {}
  ~SharedMemory() {
    if (descriptor_ >= 0) ::close(descriptor_);
  }
  SharedMemory(const SharedMemory&) = delete;
  SharedMemory& operator=(const SharedMemory&) = delete;

  [[nodiscard]] bool is_open() const noexcept { return descriptor_ >= 0; }
  bool write(std::span<const std::byte> bytes, ::off_t at) const {
    while (!bytes.empty()) {
      const ::ssize_t done = ::pwrite(descriptor_, bytes.data(), bytes.size(), at);
      if (done < 0 && errno == EINTR) continue;
      if (done <= 0) return false;
      bytes = bytes.subspan(static_cast<std::size_t>(done));
      at += done;
    }
    return true;
  }
  [[nodiscard]] Bytes read() const {
    struct stat status {};
    if (::fstat(descriptor_, &status) != 0) return {};
    Bytes bytes(static_cast<std::size_t>(status.st_size));
    for (std::size_t at = 0; at < bytes.size();) {
      const ::ssize_t got = ::pread(descriptor_, bytes.data() + at, bytes.size() - at, static_cast<::off_t>(at));
      if (got < 0 && errno == EINTR) continue;
      if (got <= 0) return {};
      at += static_cast<std::size_t>(got);
    }
    return bytes;
  }

 private:
  int descriptor_;
};

/// Whatever happens in the child, it prints nothing, ends with its parent, and leaves no core file.
void prepare_child(std::uint64_t file_bytes) {
  ::prctl(PR_SET_PDEATHSIG, SIGKILL);
  for (const int signal : {SIGSEGV, SIGBUS, SIGFPE, SIGILL, SIGABRT, SIGXCPU}) std::signal(signal, SIG_DFL);
  const int nowhere = ::open("/dev/null", O_RDWR | O_CLOEXEC);
  for (const int stream : {STDOUT_FILENO, STDERR_FILENO}) ::dup2(nowhere, stream);
  const rlimit no_core{0, 0};
  ::setrlimit(RLIMIT_CORE, &no_core);
  const rlim_t seconds = least_seconds + file_bytes / bytes_per_second;
  const rlimit processor{seconds, seconds};
  ::setrlimit(RLIMIT_CPU, &processor);
}

/// Writes the result of `work`, or its Error: status, then message. The first byte says which, and is written last.
void work_in_child(const std::function<Bytes()>& work, const SharedMemory& memory) {
  std::optional<Error> error;
  Bytes result;
  try {
    result = work();
  } catch (const Error& thrown) { error = thrown; } catch (const std::bad_alloc&) {
    static_cast<void>(memory.write(std::array{has_no_memory}, 0));
    return;
  } catch (...) {  // memory is overwritten
    return;
  }
  if (error) {
    const std::string message = error->what();
    result = {static_cast<std::byte>(error->status)};
    const auto bytes = std::as_bytes(std::span(message));
    result.insert(result.end(), bytes.begin(), bytes.end());
  }
  if (memory.write(result, 1)) static_cast<void>(memory.write(std::array{error ? has_error : has_result}, 0));
}

/// Of a program that ignores SIGCHLD, the system itself waits for the child.
void wait_for(::pid_t child) {
  while (::waitpid(child, nullptr, 0) < 0 && errno == EINTR) {}
}
}  // namespace

Bytes run(const std::filesystem::path& file, const std::function<Bytes()>& work) {
  const std::uint64_t file_bytes = InputFile(file).size();
  const SharedMemory memory;
  const ::pid_t child = memory.is_open() ? ::fork() : -1;
  if (child == 0) {
    prepare_child(file_bytes);
    work_in_child(work, memory);
    std::raise(SIGKILL);  // runs no exit handlers of the program that has forked
  }
  if (child < 0)
    throw Error{Status::bad_input, file.string() + ": no process can be started to read it: " + std::strerror(errno)};
  wait_for(child);
  Bytes result = memory.read();
  const std::byte mark = result.empty() ? std::byte{} : result.front();
  if (mark == has_no_memory) throw std::bad_alloc();
  if (mark != has_result && (mark != has_error || result.size() < 2))
    throw Error{Status::bad_input, file.string() + ": libhdf5 fails to read it; it is damaged, export it again (HDF5)"};
  result.erase(result.begin());
  if (mark == has_result) return result;
  const auto status = static_cast<Status>(result.front());
  const bool is_unsupported = status == Status::unsupported_input;
  throw Error{is_unsupported ? status : Status::bad_input,
              std::string(as_text(std::span<const std::byte>(result).subspan(1)))};
}
}  // namespace lbea::io::child
