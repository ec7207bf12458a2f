/* not_utf16 PROGRAM: starts PROGRAM with the name of a file that is not UTF-16; ends with its exit code, or 99. */
#include <windows.h>

#include <wchar.h>

int main(int argc, char** argv) {
  if (argc != 2) return 99;
  wchar_t line[1024];
  if (swprintf(line, 1024, L"\"%hs\" no-\xd800.lbea", argv[1]) < 0) return 99;
  STARTUPINFOW start = {.cb = sizeof start};
  PROCESS_INFORMATION program;
  DWORD code = 99;
  if (!CreateProcessW(NULL, line, NULL, NULL, TRUE, 0, NULL, NULL, &start, &program)) return 99;
  WaitForSingleObject(program.hProcess, INFINITE);
  GetExitCodeProcess(program.hProcess, &code);
  return (int)code;
}
