#include "tools/shared/system/process.hpp"

#include "runtime/src/model/mapped_file.hpp"

#include <cstdio>
#include <cstdlib>

#include <fcntl.h>
#include <io.h>

#define WIN32_LEAN_AND_MEAN
#include <windows.h>

#include <psapi.h>
#include <shellapi.h>
#include <timeapi.h>

namespace lbea::tool {
namespace {

void (*stop_program)() = nullptr;
UINT earlier_code_page = 0;

HANDLE stream(DWORD which) noexcept { return ::GetStdHandle(which); }

/// A mapped file has become shorter, or its disk has failed.
LONG WINAPI end_without_file(EXCEPTION_POINTERS* exception) {
  if (exception->ExceptionRecord->ExceptionCode != static_cast<DWORD>(EXCEPTION_IN_PAGE_ERROR))
    return EXCEPTION_CONTINUE_SEARCH;
  end_process("error: a file became shorter while it was read, or its disk failed; replace files by renaming others\n");
}

void show_utf8() {
  earlier_code_page = ::GetConsoleOutputCP();
  if (earlier_code_page == 0 || ::SetConsoleOutputCP(CP_UTF8) == 0) return;  // without a console
  std::atexit([] { ::SetConsoleOutputCP(earlier_code_page); });
  DWORD mode = 0;
  if (::GetConsoleMode(stream(STD_ERROR_HANDLE), &mode) != 0)  // the log's colors
    ::SetConsoleMode(stream(STD_ERROR_HANDLE), mode | ENABLE_VIRTUAL_TERMINAL_PROCESSING);
}

/// Otherwise waits end at the next tick of a clock of 15.6 ms, and Windows 11 slows down programs without a window.
void keep_pace() {
  ::timeBeginPeriod(1);
  PROCESS_POWER_THROTTLING_STATE state{};
  state.Version = PROCESS_POWER_THROTTLING_CURRENT_VERSION;
  constexpr ULONG ignore_timer_resolution = 4;  // not in every version of the header
  state.ControlMask = PROCESS_POWER_THROTTLING_EXECUTION_SPEED | ignore_timer_resolution;
  ::SetProcessInformation(::GetCurrentProcess(), ProcessPowerThrottling, &state, sizeof state);
}

/// On a thread of the system's. After a closed console, a logoff or a shutdown the process ends when this returns, so
/// it waits until main() has returned, for as long as the system allows.
BOOL WINAPI stop(DWORD event) {
  stop_program();
  if (event != CTRL_C_EVENT && event != CTRL_BREAK_EVENT) ::Sleep(INFINITE);
  return TRUE;
}

}  // namespace

void prepare_process() {
  ::SetErrorMode(SEM_FAILCRITICALERRORS | SEM_NOGPFAULTERRORBOX);  // errors without a dialog
  ::SetUnhandledExceptionFilter(end_without_file);
  for (std::FILE* const file : {stdout, stderr}) ::_setmode(::_fileno(file), _O_BINARY);
  show_utf8();
  keep_pace();
}

std::vector<std::string> arguments_of(int, char**) {
  int count = 0;
  wchar_t** const texts = ::CommandLineToArgvW(::GetCommandLineW(), &count);
  std::vector<std::string> arguments;
  for (int i = 1; i < count; ++i) arguments.push_back(name_of(texts[i]));  // also of what is not UTF-16
  ::LocalFree(texts);
  return arguments;
}

bool lost_its_reader() {
  const unsigned long error = _doserrno;  // of the last write
  return ::GetFileType(stream(STD_OUTPUT_HANDLE)) == FILE_TYPE_PIPE &&
         (error == ERROR_BROKEN_PIPE || error == ERROR_NO_DATA || error == ERROR_PIPE_NOT_CONNECTED);
}

ProcessUse process_use() {
  PROCESS_MEMORY_COUNTERS memory{};
  DWORD handles = 0;
  ::K32GetProcessMemoryInfo(::GetCurrentProcess(), &memory, sizeof memory);
  ::GetProcessHandleCount(::GetCurrentProcess(), &handles);
  return {memory.WorkingSetSize, handles};
}

void end_process(std::string_view sentence) noexcept {
  DWORD written = 0;
  ::WriteFile(stream(STD_ERROR_HANDLE), sentence.data(), static_cast<DWORD>(sentence.size()), &written, nullptr);
  ::ExitProcess(1);
}

void on_stop_request(void (*stop_function)()) {
  stop_program = stop_function;
  ::SetConsoleCtrlHandler(stop, TRUE);
}

}  // namespace lbea::tool
