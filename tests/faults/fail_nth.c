// Loaded before a program (LD_PRELOAD): counts its calls of one kind and fails the n-th.
//   LBEA_FAULT_CALL   write | sync | rename | truncate | map | thread | allocate
//   LBEA_FAULT_NTH    from 1; 0 or nothing: all succeed
//   LBEA_FAULT_PATH   only calls on files whose path begins so (not for thread and allocate)
//   LBEA_FAULT_COUNT  a file that is told at the program's end how often the call was made
//   LBEA_FAULT_ASKERS a file that is told, when a thread or an allocation fails, which libraries asked for it: in each
//   line a name and an offset
// What happens before main() does not count: no program can answer for that.
#define _GNU_SOURCE
#include <dlfcn.h>
#include <errno.h>
#include <execinfo.h>
#include <fcntl.h>
#include <pthread.h>
#include <stdatomic.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <sys/uio.h>
#include <unistd.h>

enum Call { call_none, call_write, call_sync, call_rename, call_truncate, call_map, call_thread, call_allocate };
static const char* const names[] = {"", "write", "sync", "rename", "truncate", "map", "thread", "allocate"};

static enum Call watched = call_none;  // none until main() begins
static unsigned long nth = 0;
static const char* prefix = "";
static const char* count_file = NULL;
static const char* askers_file = NULL;
static atomic_ulong count = 0;

static int is_due(enum Call call) { return call == watched && atomic_fetch_add(&count, 1) + 1 == nth; }

static int is_path_due(enum Call call, const char* path) {
  char folder[4096];
  if (call != watched) return 0;
  if (path[0] != '/') path = getcwd(folder, sizeof(folder));  // what is relative is below
  return path != NULL && strncmp(path, prefix, strlen(prefix)) == 0 && is_due(call);
}

static int is_file_due(enum Call call, int descriptor) {
  if (call != watched) return 0;
  char link[64], path[4096];
  snprintf(link, sizeof(link), "/proc/self/fd/%d", descriptor);
  const ssize_t length = readlink(link, path, sizeof(path) - 1);
  if (length <= 0) return 0;
  path[length] = '\0';
  return is_path_due(call, path);
}

static int fail(int error) {
  errno = error;
  return -1;
}

// The next definition of the function that stands around it.
#define NEXT(function) ((__typeof__(&function))dlsym(RTLD_NEXT, #function))

ssize_t write(int descriptor, const void* bytes, size_t size) {
  return is_file_due(call_write, descriptor) ? fail(ENOSPC) : NEXT(write)(descriptor, bytes, size);
}
ssize_t pwrite(int descriptor, const void* bytes, size_t size, off_t offset) {
  return is_file_due(call_write, descriptor) ? fail(ENOSPC) : NEXT(pwrite)(descriptor, bytes, size, offset);
}
ssize_t writev(int descriptor, const struct iovec* pieces, int n) {
  return is_file_due(call_write, descriptor) ? fail(ENOSPC) : NEXT(writev)(descriptor, pieces, n);
}
ssize_t pwritev(int descriptor, const struct iovec* pieces, int n, off_t offset) {
  return is_file_due(call_write, descriptor) ? fail(ENOSPC) : NEXT(pwritev)(descriptor, pieces, n, offset);
}
int fsync(int descriptor) { return is_file_due(call_sync, descriptor) ? fail(EIO) : NEXT(fsync)(descriptor); }
int fdatasync(int descriptor) { return is_file_due(call_sync, descriptor) ? fail(EIO) : NEXT(fdatasync)(descriptor); }
int rename(const char* from, const char* to) {
  return is_path_due(call_rename, to) ? fail(EIO) : NEXT(rename)(from, to);
}
int link(const char* from, const char* to) { return is_path_due(call_rename, to) ? fail(EIO) : NEXT(link)(from, to); }
int ftruncate(int descriptor, off_t size) {
  return is_file_due(call_truncate, descriptor) ? fail(ENOSPC) : NEXT(ftruncate)(descriptor, size);
}
int fallocate(int descriptor, int mode, off_t offset, off_t size) {
  return is_file_due(call_truncate, descriptor) ? fail(ENOSPC) : NEXT(fallocate)(descriptor, mode, offset, size);
}
void* mmap(void* at, size_t size, int protection, int flags, int descriptor, off_t offset) {
  if (descriptor >= 0 && is_file_due(call_map, descriptor)) return fail(ENOMEM), MAP_FAILED;
  return NEXT(mmap)(at, size, protection, flags, descriptor, offset);
}

// dlsym() allocates: the C library's own names instead. operator new ends here too.
int __libc_start_main(int (*)(int, char**, char**), int, char**, void (*)(void), void (*)(void), void (*)(void), void*);
extern void* __libc_malloc(size_t size);
extern void* __libc_calloc(size_t n, size_t size);
extern void* __libc_realloc(void* block, size_t size);
extern void* __libc_memalign(size_t alignment, size_t size);

static void tell_askers(void) {
  void* calls[64];
  if (askers_file == NULL) return;
  const int depth = backtrace(calls, 64);
  const int descriptor = open(askers_file, O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0666);
  for (int i = 0; i < depth; ++i) {
    Dl_info about;
    if (dladdr(calls[i], &about) == 0 || about.dli_fname == NULL) continue;
    char offset[32];
    const int length =
        snprintf(offset, sizeof(offset), " %#lx\n", (unsigned long)((char*)calls[i] - (char*)about.dli_fbase));
    if (write(descriptor, about.dli_fname, strlen(about.dli_fname)) < 0 ||
        write(descriptor, offset, (size_t)length) < 0)
      abort();
  }
  close(descriptor);
}

int pthread_create(pthread_t* thread, const pthread_attr_t* attributes, void* (*start)(void*), void* argument) {
  if (!is_due(call_thread)) return NEXT(pthread_create)(thread, attributes, start, argument);
  tell_askers();
  return EAGAIN;
}

static void* no_memory(void) {
  watched = call_none;
  tell_askers();
  errno = ENOMEM;
  return NULL;
}
void* malloc(size_t size) { return is_due(call_allocate) ? no_memory() : __libc_malloc(size); }
void* calloc(size_t n, size_t size) { return is_due(call_allocate) ? no_memory() : __libc_calloc(n, size); }
void* realloc(void* block, size_t size) { return is_due(call_allocate) ? no_memory() : __libc_realloc(block, size); }
void* memalign(size_t alignment, size_t size) {
  return is_due(call_allocate) ? no_memory() : __libc_memalign(alignment, size);
}
void* aligned_alloc(size_t alignment, size_t size) { return memalign(alignment, size); }
int posix_memalign(void** block, size_t alignment, size_t size) {
  *block = memalign(alignment, size);
  return *block == NULL ? ENOMEM : 0;
}

static int (*real_main)(int, char**, char**);

static void begin(void) {
  const char* const call = getenv("LBEA_FAULT_CALL");
  const char* const number = getenv("LBEA_FAULT_NTH");
  if (getenv("LBEA_FAULT_PATH") != NULL) prefix = getenv("LBEA_FAULT_PATH");
  count_file = getenv("LBEA_FAULT_COUNT");
  askers_file = getenv("LBEA_FAULT_ASKERS");
  void* first;
  backtrace(&first, 1);  // loads what it needs
  if (number != NULL) nth = strtoul(number, NULL, 10);
  for (int i = call_write; i <= call_allocate; ++i)
    if (call != NULL && strcmp(call, names[i]) == 0) watched = (enum Call)i;
}

static int watched_main(int argc, char** argv, char** environment) {
  begin();
  return real_main(argc, argv, environment);
}

int __libc_start_main(int (*start)(int, char**, char**), int argc, char** argv, void (*init)(void), void (*fini)(void),
                      void (*loader_fini)(void), void* stack_end) {
  real_main = start;
  return NEXT(__libc_start_main)(watched_main, argc, argv, init, fini, loader_fini, stack_end);
}

__attribute__((destructor)) static void tell(void) {
  watched = call_none;
  if (count_file == NULL) return;
  char text[32];
  const int length = snprintf(text, sizeof(text), "%lu\n", atomic_load(&count));
  const int descriptor = open(count_file, O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0666);
  if (descriptor < 0) return;
  if (write(descriptor, text, (size_t)length) < 0) abort();
  close(descriptor);
}
