/* Records every call that changes a directory, and may stop or end the process at one.

   gcc -shared -fPIC -O1 -o shim.so shim.c -ldl; put in a process by LD_PRELOAD, where it
   does nothing until it is told of a directory: by its function `watch`, or, in what
   such a process begins, by the environment CRASH_ROOT and CRASH_LOG.

   A line of the log tells a call that has been made:
     kind offset size inode time path TAB other-path, and after it `size` bytes of data.
   What is written through memory is told before the next call, as a write of its own. */

#define _GNU_SOURCE
#include <dlfcn.h>
#include <errno.h>
#include <fcntl.h>
#include <pthread.h>
#include <signal.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <sys/sendfile.h>
#include <sys/stat.h>
#include <sys/uio.h>
#include <unistd.h>

#define MOST 4096
#define MAPS 16

static char root[MOST];
static size_t root_size;
static int sink = -1, hits, strike_at = -1, strike_by;
static pthread_mutex_t lock = PTHREAD_RECURSIVE_MUTEX_INITIALIZER_NP;

static struct {
  char *at, *before;
  size_t size;
  struct stat state;
  char path[MOST];
} maps[MAPS];

#define REAL(result, name, ...)                    \
  static result (*real)(__VA_ARGS__);              \
  if (!real) *(void **)&real = dlsym(RTLD_NEXT, name)

void watch(const char *folder, const char *log, int at, int by) {
  REAL(int, "open", const char *, int, ...);
  root_size = strlen(folder);
  memcpy(root, folder, root_size + 1);
  sink = real(log, O_WRONLY | O_CREAT | O_APPEND | O_CLOEXEC, 0644);
  hits = 0, strike_at = at, strike_by = by;
}

__attribute__((constructor)) static void begin(void) {
  const char *folder = getenv("CRASH_ROOT"), *log = getenv("CRASH_LOG");
  if (folder && log) watch(folder, log, -1, 0);
}

static int inside(const char *path) {
  return sink >= 0 && !strncmp(path, root, root_size) &&
         (path[root_size] == '/' || !path[root_size]);
}

/* The absolute path of a name, its last part not followed; 0 where it is elsewhere. */
static int full(int folder, const char *name, char *out) {
  if (sink < 0 || !name) return 0;
  char place[MOST] = "";
  if (name[0] != '/') {
    if (folder == AT_FDCWD) {
      if (!getcwd(place, sizeof place)) return 0;
    } else {
      char link[64];
      snprintf(link, sizeof link, "/proc/self/fd/%d", folder);
      ssize_t n = readlink(link, place, sizeof place - 1);
      if (n < 0) return 0;
      place[n] = 0;
    }
    strncat(place, "/", sizeof place - strlen(place) - 1);
  }
  if (snprintf(out, MOST, "%s%s", place, name) >= MOST) return 0;
  return inside(out);
}

static int of_handle(int fd, char *out, struct stat *state) {
  if (sink < 0 || fd == sink) return 0;
  char link[64];
  snprintf(link, sizeof link, "/proc/self/fd/%d", fd);
  ssize_t n = readlink(link, out, MOST - 1);
  if (n < 0) return 0;
  out[n] = 0;
  return inside(out) && !fstat(fd, state) &&
         (S_ISREG(state->st_mode) || S_ISDIR(state->st_mode));
}

static void tell(const char *kind, long long offset, size_t size, struct stat *state,
                 const char *path, const char *other, const void *data) {
  char head[2 * MOST + 128];
  long long time = state->st_mtim.tv_sec * 1000000000LL + state->st_mtim.tv_nsec;
  int n = snprintf(head, sizeof head, "%s %lld %zu %lu %lld %s\t%s\n", kind, offset,
                   size, (unsigned long)state->st_ino, time, path + root_size,
                   other ? other + root_size : "");
  struct iovec parts[2] = {{head, (size_t)n}, {(void *)data, data ? size : 0}};
  REAL(ssize_t, "writev", int, const struct iovec *, int);
  if (real(sink, parts, 2) < 0) abort();
}

static void tell_memory(void) {
  for (int i = 0; i < MAPS; i++) {
    if (!maps[i].at || !memcmp(maps[i].at, maps[i].before, maps[i].size)) continue;
    memcpy(maps[i].before, maps[i].at, maps[i].size);
    tell("memory", 0, maps[i].size, &maps[i].state, maps[i].path, NULL,
         maps[i].before);
  }
}

/* Before a call: what memory has changed is told; the process may end or stop here. */
static void before(void) {
  pthread_mutex_lock(&lock);
  int saved = errno;
  tell_memory();
  if (hits++ == strike_at) raise(strike_by);
  errno = saved;
}

static void after(void) { pthread_mutex_unlock(&lock); }

/* Opening */

static int opened(const char *name, int folder, const char *path, int flags,
                  mode_t mode) {
  REAL(int, "openat", int, const char *, int, ...);
  (void)name;
  char where[MOST];
  int ours = (flags & (O_CREAT | O_TRUNC)) && full(folder, path, where);
  if (!ours) return real(folder, path, flags, mode);
  struct stat old, new;
  before();
  int there = !fstatat(folder, path, &old, 0);
  int fd = real(folder, path, flags, mode);
  int saved = errno;
  if (fd >= 0 && !fstat(fd, &new)) {
    if (!there) tell("create", 0, 0, &new, where, NULL, NULL);
    else if ((flags & O_TRUNC) && old.st_size) {
      tell("size", 0, 0, &new, where, NULL, NULL);
    }
  }
  errno = saved;
  after();
  return fd;
}

#define MODE                                        \
  mode_t mode = 0;                                  \
  if (flags & (O_CREAT | O_TMPFILE)) {              \
    va_list more;                                   \
    va_start(more, flags);                          \
    mode = va_arg(more, mode_t);                    \
    va_end(more);                                   \
  }

int open(const char *path, int flags, ...) {
  MODE return opened("open", AT_FDCWD, path, flags, mode);
}
int open64(const char *path, int flags, ...) {
  MODE return opened("open64", AT_FDCWD, path, flags | O_LARGEFILE, mode);
}
int openat(int folder, const char *path, int flags, ...) {
  MODE return opened("openat", folder, path, flags, mode);
}
int openat64(int folder, const char *path, int flags, ...) {
  MODE return opened("openat64", folder, path, flags | O_LARGEFILE, mode);
}
int creat(const char *path, mode_t mode) {
  return opened("creat", AT_FDCWD, path, O_CREAT | O_WRONLY | O_TRUNC, mode);
}

/* Writing */

#define WRITES(NAME, PARAMETERS, TYPES, CALL, WHERE, DATA)              \
  ssize_t NAME PARAMETERS {                                             \
    REAL(ssize_t, #NAME, TYPES);                                        \
    char path[MOST];                                                    \
    struct stat state;                                                  \
    if (!of_handle(fd, path, &state)) return real CALL;                 \
    before();                                                           \
    ssize_t done = real CALL;                                           \
    int saved = errno;                                                  \
    fstat(fd, &state);                                                  \
    if (done > 0) tell("write", WHERE, done, &state, path, NULL, DATA); \
    errno = saved;                                                      \
    after();                                                            \
    return done;                                                        \
  }
#define TYPES_W int, const void *, size_t
#define TYPES_P int, const void *, size_t, off64_t
#define HERE (lseek(fd, 0, SEEK_CUR) - done)

WRITES(write, (int fd, const void *data, size_t size), TYPES_W, (fd, data, size), HERE,
       data)
WRITES(pwrite, (int fd, const void *data, size_t size, off_t at), TYPES_P,
       (fd, data, size, at), (long long)at, data)
WRITES(pwrite64, (int fd, const void *data, size_t size, off64_t at), TYPES_P,
       (fd, data, size, at), (long long)at, data)

/* What is written from many places, or copied within the kernel, is read back. */
static void tell_back(int fd, const char *path, struct stat *state, long long at,
                      size_t size) {
  char link[64], *data = malloc(size);
  REAL(int, "open", const char *, int, ...);
  snprintf(link, sizeof link, "/proc/self/fd/%d", fd);
  int copy = real(link, O_RDONLY);
  if (!data || copy < 0 || pread(copy, data, size, at) != (ssize_t)size) abort();
  tell("write", at, size, state, path, NULL, data);
  close(copy);
  free(data);
}

#define COPIES(NAME, PARAMETERS, TYPES, CALL, FD, WHERE)                \
  ssize_t NAME PARAMETERS {                                             \
    REAL(ssize_t, #NAME, TYPES);                                        \
    char path[MOST];                                                    \
    struct stat state;                                                  \
    if (!of_handle(FD, path, &state)) return real CALL;                 \
    before();                                                           \
    ssize_t done = real CALL;                                           \
    int saved = errno;                                                  \
    fstat(FD, &state);                                                  \
    if (done > 0) tell_back(FD, path, &state, WHERE, done);             \
    errno = saved;                                                      \
    after();                                                            \
    return done;                                                        \
  }
#define TYPES_V int, const struct iovec *, int
#define TYPES_PV int, const struct iovec *, int, off64_t
#define TYPES_S int, int, off64_t *, size_t
#define TYPES_C int, off64_t *, int, off64_t *, size_t, unsigned

COPIES(writev, (int fd, const struct iovec *parts, int count), TYPES_V,
       (fd, parts, count), fd, HERE)
COPIES(pwritev, (int fd, const struct iovec *parts, int count, off_t at), TYPES_PV,
       (fd, parts, count, at), fd, (long long)at)
COPIES(pwritev64, (int fd, const struct iovec *parts, int count, off64_t at), TYPES_PV,
       (fd, parts, count, at), fd, (long long)at)
COPIES(sendfile, (int to, int from, off_t *at, size_t size), TYPES_S,
       (to, from, at, size), to, lseek(to, 0, SEEK_CUR) - done)
COPIES(sendfile64, (int to, int from, off64_t *at, size_t size), TYPES_S,
       (to, from, at, size), to, lseek(to, 0, SEEK_CUR) - done)
COPIES(copy_file_range,
       (int from, off64_t *start, int to, off64_t *at, size_t size, unsigned flags),
       TYPES_C, (from, start, to, at, size, flags), to,
       (at ? (long long)*at : lseek(to, 0, SEEK_CUR)) - done)

/* Sizes and syncs */

#define HANDLES(NAME, PARAMETERS, TYPES, CALL, KIND, WHERE)             \
  int NAME PARAMETERS {                                                 \
    REAL(int, #NAME, TYPES);                                            \
    char path[MOST];                                                    \
    struct stat state;                                                  \
    if (!of_handle(fd, path, &state)) return real CALL;                 \
    before();                                                           \
    int done = real CALL;                                               \
    int saved = errno;                                                  \
    fstat(fd, &state);                                                  \
    if (!done) tell(KIND, WHERE, 0, &state, path, NULL, NULL);          \
    errno = saved;                                                      \
    after();                                                            \
    return done;                                                        \
  }
#define TYPES_F int, off64_t
#define TYPES_A int, off64_t, off64_t

HANDLES(ftruncate, (int fd, off_t size), TYPES_F, (fd, size), "size", (long long)size)
HANDLES(ftruncate64, (int fd, off64_t size), TYPES_F, (fd, size), "size",
        (long long)size)
HANDLES(posix_fallocate, (int fd, off_t at, off_t size), TYPES_A, (fd, at, size),
        "grow", (long long)(at + size))
HANDLES(posix_fallocate64, (int fd, off64_t at, off64_t size), TYPES_A, (fd, at, size),
        "grow", (long long)(at + size))
HANDLES(fsync, (int fd), int, (fd), "sync", 0)
HANDLES(fdatasync, (int fd), int, (fd), "sync", 0)

/* Names */

#define NAMES(NAME, PARAMETERS, TYPES, CALL, KIND, FOLDER, PATH)        \
  int NAME PARAMETERS {                                                 \
    REAL(int, #NAME, TYPES);                                            \
    char path[MOST];                                                    \
    struct stat state = {0};                                            \
    if (!full(FOLDER, PATH, path)) return real CALL;                    \
    before();                                                           \
    fstatat(FOLDER, PATH, &state, AT_SYMLINK_NOFOLLOW);                 \
    int done = real CALL;                                               \
    int saved = errno;                                                  \
    if (!done && !state.st_ino) {                                       \
      fstatat(FOLDER, PATH, &state, AT_SYMLINK_NOFOLLOW);               \
    }                                                                   \
    if (!done) tell(KIND, 0, 0, &state, path, NULL, NULL);              \
    errno = saved;                                                      \
    after();                                                            \
    return done;                                                        \
  }
#define TYPES_N const char *
#define TYPES_AT int, const char *, int
#define TYPES_M const char *, mode_t
#define TYPES_MAT int, const char *, mode_t

NAMES(unlink, (const char *name), TYPES_N, (name), "unlink", AT_FDCWD, name)
NAMES(unlinkat, (int folder, const char *name, int flags), TYPES_AT,
      (folder, name, flags), flags & AT_REMOVEDIR ? "rmdir" : "unlink", folder, name)
NAMES(rmdir, (const char *name), TYPES_N, (name), "rmdir", AT_FDCWD, name)
NAMES(mkdir, (const char *name, mode_t mode), TYPES_M, (name, mode), "mkdir", AT_FDCWD,
      name)
NAMES(mkdirat, (int folder, const char *name, mode_t mode), TYPES_MAT,
      (folder, name, mode), "mkdir", folder, name)

/* A rename or a link; one that comes from elsewhere is not foreseen. */
#define MOVES(NAME, PARAMETERS, TYPES, CALL, KIND, FROM, OLD, TO, NEW)  \
  int NAME PARAMETERS {                                                 \
    REAL(int, #NAME, TYPES);                                            \
    char old[MOST], new[MOST];                                          \
    struct stat state = {0};                                            \
    int comes = full(FROM, OLD, old), goes = full(TO, NEW, new);        \
    if (!comes && !goes) return real CALL;                              \
    before();                                                           \
    fstatat(FROM, OLD, &state, AT_SYMLINK_NOFOLLOW);                    \
    int done = real CALL;                                               \
    int saved = errno;                                                  \
    if (!done && !(comes && goes)) abort();                             \
    if (!done) tell(KIND, 0, 0, &state, old, new, NULL);                \
    errno = saved;                                                      \
    after();                                                            \
    return done;                                                        \
  }
#define TYPES_NN const char *, const char *
#define TYPES_NAT int, const char *, int, const char *
#define TYPES_NATF int, const char *, int, const char *, unsigned
#define TYPES_LAT int, const char *, int, const char *, int

MOVES(rename, (const char *a, const char *b), TYPES_NN, (a, b), "rename", AT_FDCWD, a,
      AT_FDCWD, b)
MOVES(renameat, (int from, const char *a, int to, const char *b), TYPES_NAT,
      (from, a, to, b), "rename", from, a, to, b)
MOVES(renameat2, (int from, const char *a, int to, const char *b, unsigned how),
      TYPES_NATF, (from, a, to, b, how), "rename", from, a, to, b)
MOVES(link, (const char *a, const char *b), TYPES_NN, (a, b), "link", AT_FDCWD, a,
      AT_FDCWD, b)
MOVES(linkat, (int from, const char *a, int to, const char *b, int how), TYPES_LAT,
      (from, a, to, b, how), "link", from, a, to, b)

/* Memory of files */

static void *mapped(void *at, size_t size, int access, int how, int fd, off64_t start) {
  REAL(void *, "mmap", void *, size_t, int, int, int, off64_t);
  char path[MOST];
  struct stat state;
  void *found = real(at, size, access, how, fd, start);
  int writes = (how & MAP_SHARED) && (access & PROT_WRITE) && fd >= 0;
  if (found == MAP_FAILED || !writes || !of_handle(fd, path, &state)) return found;
  pthread_mutex_lock(&lock);
  for (int i = 0; i < MAPS; i++) {
    if (maps[i].at) continue;
    maps[i].before = malloc(size);
    if (!maps[i].before || start) abort();
    memcpy(maps[i].before, found, size);
    strcpy(maps[i].path, path);
    maps[i].size = size, maps[i].state = state, maps[i].at = found;
    break;
  }
  pthread_mutex_unlock(&lock);
  return found;
}
void *mmap(void *at, size_t size, int access, int how, int fd, off_t start) {
  return mapped(at, size, access, how, fd, start);
}
void *mmap64(void *at, size_t size, int access, int how, int fd, off64_t start) {
  return mapped(at, size, access, how, fd, start);
}

int munmap(void *at, size_t size) {
  REAL(int, "munmap", void *, size_t);
  for (int i = 0; sink >= 0 && i < MAPS; i++) {
    if (maps[i].at != at) continue;
    before();
    free(maps[i].before);
    maps[i].at = NULL;
    after();
  }
  return real(at, size);
}
