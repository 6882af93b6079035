/* Preloaded by test_saves_that_fail.py: makes allocations or writes of its process fail from a chosen call on. */
#define _GNU_SOURCE
#include <dlfcn.h>
#include <errno.h>
#include <stddef.h>
#include <sys/uio.h>
#include <unistd.h>

enum { NOTHING, ALLOCATIONS, WRITES };

static int failing = NOTHING;
static int only_one = 0;
static long calls = 0;
static long first = -1;

void start_failing(int kind, long first_call, int once)
{
    failing = kind;
    first = first_call;
    only_one = once;
    calls = 0;
}

long stop_failing(void)
{
    failing = NOTHING;
    return calls;
}

static int fails(int kind, int error)
{
    if (failing != kind)
        return 0;
    const long call = calls++;
    if (first < 0 || call < first || (only_one && call > first))
        return 0;
    errno = error;
    return 1;
}

extern void *__libc_malloc(size_t), *__libc_calloc(size_t, size_t), *__libc_realloc(void *, size_t);
void *malloc(size_t size) { return fails(ALLOCATIONS, ENOMEM) ? NULL : __libc_malloc(size); }
void *calloc(size_t count, size_t size) { return fails(ALLOCATIONS, ENOMEM) ? NULL : __libc_calloc(count, size); }
void *realloc(void *memory, size_t size) { return fails(ALLOCATIONS, ENOMEM) ? NULL : __libc_realloc(memory, size); }

ssize_t write(int file, const void *data, size_t size)
{
    static ssize_t (*real)(int, const void *, size_t);
    real = real ? real : dlsym(RTLD_NEXT, "write");
    return fails(WRITES, ENOSPC) ? -1 : real(file, data, size);
}

ssize_t writev(int file, const struct iovec *data, int count)
{
    static ssize_t (*real)(int, const struct iovec *, int);
    real = real ? real : dlsym(RTLD_NEXT, "writev");
    return fails(WRITES, ENOSPC) ? -1 : real(file, data, count);
}

int fsync(int file)
{
    static int (*real)(int);
    real = real ? real : dlsym(RTLD_NEXT, "fsync");
    return fails(WRITES, EIO) ? -1 : real(file);
}

int close(int file)
{
    static int (*real)(int);
    real = real ? real : dlsym(RTLD_NEXT, "close");
    const int result = real(file);
    return fails(WRITES, EDQUOT) ? -1 : result;
}
