// Preloaded: adds the seconds in the file LBEA_CLOCK_STEP, which may change at any time, to the system's clock; the
// machine has as many pages of memory as LBEA_MEMORY_PAGES says.
#define _GNU_SOURCE
#include <dlfcn.h>
#include <fcntl.h>
#include <stdlib.h>
#include <sys/mman.h>
#include <time.h>
#include <unistd.h>

static const volatile long long* step_s;

__attribute__((constructor)) static void map_step(void) {
  const char* file = getenv("LBEA_CLOCK_STEP");
  const int descriptor = file ? open(file, O_RDONLY) : -1;
  void* address = descriptor < 0 ? MAP_FAILED : mmap(0, sizeof *step_s, PROT_READ, MAP_SHARED, descriptor, 0);
  if (address != MAP_FAILED) step_s = address;
}

int clock_gettime(clockid_t clock, struct timespec* time) {
  static int (*real)(clockid_t, struct timespec*);
  if (!real) *(void**)&real = dlsym(RTLD_NEXT, "clock_gettime");
  const int failed = real(clock, time);
  if (!failed && clock == CLOCK_REALTIME && step_s) time->tv_sec += *step_s;
  return failed;
}

long sysconf(int name) {
  static long (*real)(int);
  if (!real) *(void**)&real = dlsym(RTLD_NEXT, "sysconf");
  const char* pages = getenv("LBEA_MEMORY_PAGES");
  return name == _SC_PHYS_PAGES && pages ? atol(pages) : real(name);
}
