// A console in which the user selects text takes nothing, and no call tells so: a thread of its own writes.
#include "tools/shared/text/outlet.hpp"

#include <cerrno>
#include <chrono>
#include <condition_variable>
#include <mutex>
#include <thread>
#include <utility>

#include <io.h>

#define WIN32_LEAN_AND_MEAN
#include <windows.h>

namespace lbea::tool {
namespace {

constexpr auto retry_interval = std::chrono::milliseconds(20);
constexpr auto last_wait = std::chrono::milliseconds(100);  // for the last text

/// 0 or an error number.
int write_all(HANDLE handle, std::string_view text) noexcept {
  while (!text.empty()) {
    DWORD written = 0;
    if (::WriteFile(handle, text.data(), static_cast<DWORD>(text.size()), &written, nullptr) == 0) {
      const DWORD error = ::GetLastError();
      return error == ERROR_NO_DATA || error == ERROR_BROKEN_PIPE ? EPIPE : EIO;
    }
    text.remove_prefix(written);
  }
  return 0;
}

}  // namespace

/// Shared with its thread, which may wait for a reader for ever.
class Outlet::Stream {
 public:
  explicit Stream(int descriptor) {
    const HANDLE process = ::GetCurrentProcess(), given = reinterpret_cast<HANDLE>(::_get_osfhandle(descriptor));
    ::DuplicateHandle(process, given, process, &handle_, 0, FALSE, DUPLICATE_SAME_ACCESS);
  }
  ~Stream() { ::CloseHandle(handle_); }
  Stream(const Stream&) = delete;
  Stream& operator=(const Stream&) = delete;

  void run() {
    std::unique_lock lock(mutex_);
    while (true) {
      changed_.wait(lock, [this] { return has_ended_ || !text_.empty(); });
      if (text_.empty()) return;
      const std::string text = text_;
      lock.unlock();
      const int error = write_all(handle_, text);
      lock.lock();
      error_ = error;
      text_.clear();
      changed_.notify_all();
    }
  }

  bool write(std::string_view text, const std::function<bool()>& gives_up) {
    std::unique_lock lock(mutex_);
    if (!wait_until_idle(lock, gives_up)) return errno = EAGAIN, false;
    text_ = text;
    changed_.notify_all();
    if (!wait_until_idle(lock, gives_up)) return errno = EAGAIN, false;
    return error_ == 0 || (errno = error_, false);
  }

  void end() {
    std::unique_lock lock(mutex_);
    changed_.wait_for(lock, last_wait, [this] { return text_.empty(); });
    has_ended_ = true;
    changed_.notify_all();
  }

 private:
  bool wait_until_idle(std::unique_lock<std::mutex>& lock, const std::function<bool()>& gives_up) {
    while (!text_.empty()) {
      if (gives_up()) return false;
      changed_.wait_for(lock, retry_interval);
    }
    return true;
  }

  std::mutex mutex_;
  std::condition_variable changed_;
  std::string text_;  // that the thread writes
  int error_ = 0;     // of the last text
  bool has_ended_ = false;
  HANDLE handle_ = INVALID_HANDLE_VALUE;
};

Outlet::Outlet(int descriptor) : stream_(std::make_shared<Stream>(descriptor)) {
  std::thread([stream = stream_] { stream->run(); }).detach();
}

Outlet::~Outlet() { stream_->end(); }

bool Outlet::write(std::string_view text, const std::function<bool()>& gives_up) const {
  return text.empty() || stream_->write(text, gives_up);
}

}  // namespace lbea::tool
