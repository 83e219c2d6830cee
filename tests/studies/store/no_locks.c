/* Stands in for a network file system: whatever lies below a folder called no_locks.
   FOLDER=shared: locks of shared memory fail. FOLDER=busy: they are always taken.
   FOLDER=memory: memory cannot be shared. FOLDER=locks: no file has locks.
   SQLite tries again for up to ten seconds; its waits end at once. */
#define _GNU_SOURCE
#include <dlfcn.h>
#include <errno.h>
#include <fcntl.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <unistd.h>

static int lies_in(int fd, const char *name)
{
    char link[64], path[4096];
    snprintf(link, sizeof link, "/proc/self/fd/%d", fd);
    ssize_t length = readlink(link, path, sizeof path - 1);
    if (length < 0)
        return 0;
    path[length] = 0;
    return strstr(path, "/no_locks/") && strstr(path, name);
}

static int is(const char *kind)
{
    const char *folder = getenv("FOLDER");
    return folder && !strcmp(folder, kind);
}

static int refused(int fd, int command, struct flock *lock)
{
    if (command != F_SETLK && command != F_SETLKW && command != F_OFD_SETLK)
        return 0;
    if (is("shared") && lies_in(fd, "results.sqlite-shm"))
        return ENOLCK;
    if (is("busy") && lies_in(fd, "results.sqlite-shm") && lock->l_type != F_UNLCK)
        return EAGAIN;
    if (is("locks") && lies_in(fd, "results.sqlite"))
        return ENOLCK;
    return 0;
}

#define FCNTL(name)                                                     \
    int name(int fd, int command, ...)                                  \
    {                                                                   \
        static int (*usual)(int, int, ...);                             \
        va_list arguments;                                              \
        va_start(arguments, command);                                   \
        void *argument = va_arg(arguments, void *);                     \
        va_end(arguments);                                              \
        if (!usual)                                                     \
            usual = dlsym(RTLD_NEXT, #name);                            \
        errno = refused(fd, command, argument);                         \
        return errno ? -1 : usual(fd, command, argument);               \
    }
FCNTL(fcntl)
FCNTL(fcntl64)

#define MMAP(name)                                                                   \
    void *name(void *at, size_t size, int access, int flags, int fd, off_t offset)   \
    {                                                                                \
        static void *(*usual)(void *, size_t, int, int, int, off_t);                 \
        if (!usual)                                                                  \
            usual = dlsym(RTLD_NEXT, #name);                                         \
        if (is("memory") && fd >= 0 && lies_in(fd, "results.sqlite-shm")) {          \
            errno = ENODEV;                                                          \
            return MAP_FAILED;                                                       \
        }                                                                            \
        return usual(at, size, access, flags, fd, offset);                           \
    }
MMAP(mmap)
MMAP(mmap64)

int usleep(useconds_t microseconds)
{
    (void)microseconds;
    return 0;
}
