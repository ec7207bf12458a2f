// Key files on Windows. A new secret key is for its user alone; who may read or change a file that is read is not
// checked.
#include "adapters/wire/access/key_files.hpp"

#include <lbea/lbea.hpp>

#include <array>
#include <fstream>
#include <memory>
#include <system_error>

#define WIN32_LEAN_AND_MEAN
#include <windows.h>

#include <sddl.h>

namespace lbea::wire {
namespace {
struct Free {
  void operator()(void* memory) const noexcept { ::LocalFree(memory); }
};
using SecurityDescriptor = std::unique_ptr<void, Free>;

[[noreturn]] void fail(const std::filesystem::path& file, DWORD error) {
  const auto condition = std::system_category().default_error_condition(static_cast<int>(error));
  const std::string why =
      condition.category() == std::generic_category() ? condition.message() : "error " + std::to_string(error);
  throw Error{Status::write_failed,
              file.string() + ": " +
                  (error == ERROR_FILE_EXISTS ? "exists; keys are never overwritten, choose another name"
                                              : "cannot be written (" + why + ")")};
}

/// Empty on failure, with the system's error number.
std::wstring user_id() {
  HANDLE token = nullptr;
  if (::OpenProcessToken(::GetCurrentProcess(), TOKEN_QUERY, &token) == 0) return {};
  alignas(TOKEN_USER) std::array<std::byte, sizeof(TOKEN_USER) + SECURITY_MAX_SID_SIZE> user{};
  DWORD size = 0;
  wchar_t* text = nullptr;
  const bool is_known =
      ::GetTokenInformation(token, TokenUser, user.data(), static_cast<DWORD>(user.size()), &size) != 0 &&
      ::ConvertSidToStringSidW(reinterpret_cast<const TOKEN_USER*>(user.data())->User.Sid, &text) != 0;
  ::CloseHandle(token);
  const std::unique_ptr<void, Free> freed(text);
  return is_known ? text : L"";
}

/// Full access for the user of this process and nobody else, whatever the folder grants.
SecurityDescriptor for_user_alone(const std::filesystem::path& file) {
  const std::wstring user = user_id(), rule = L"D:P(A;;FA;;;" + user + L")";
  void* descriptor = nullptr;
  if (user.empty() ||
      ::ConvertStringSecurityDescriptorToSecurityDescriptorW(rule.c_str(), SDDL_REVISION_1, &descriptor, nullptr) == 0)
    fail(file, ::GetLastError());
  return SecurityDescriptor(descriptor);
}
}  // namespace

std::string read_key_file(const std::filesystem::path& file, bool is_secret) {
  std::ifstream in(file, std::ios::binary);
  if (!in)
    throw Error{Status::file_not_found,
                file.string() + ": cannot read this key file; check its path, or make one with lbea-keygen"};
  std::string text(max_key_file_bytes + 1, '\0');
  in.read(text.data(), static_cast<std::streamsize>(text.size()));
  text.resize(static_cast<std::size_t>(in.gcount()));
  if (in.bad() || text.size() > max_key_file_bytes)
    refuse_key_file(file, "is not a key file; make one with lbea-keygen");
  check_key_text(file, text, is_secret);
  return text;
}

void write_key_file(const std::filesystem::path& file, const std::string& text, bool is_secret) {
  const SecurityDescriptor descriptor = is_secret ? for_user_alone(file) : SecurityDescriptor();
  SECURITY_ATTRIBUTES access{sizeof(SECURITY_ATTRIBUTES), descriptor.get(), FALSE};
  const HANDLE open =
      ::CreateFileW(file.c_str(), GENERIC_WRITE, 0, &access, CREATE_NEW, FILE_ATTRIBUTE_NORMAL, nullptr);
  if (open == INVALID_HANDLE_VALUE) fail(file, ::GetLastError());
  DWORD written = 0;
  const bool is_written = ::WriteFile(open, text.data(), static_cast<DWORD>(text.size()), &written, nullptr) != 0 &&
                          written == text.size() && ::FlushFileBuffers(open) != 0;
  const DWORD error = ::GetLastError();
  ::CloseHandle(open);
  if (is_written) return;
  ::DeleteFileW(file.c_str());
  fail(file, error);
}
}  // namespace lbea::wire
