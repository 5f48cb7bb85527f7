// Preloaded: writes to regular files write less than they are asked to, as they may on full disks, network file systems and after
// signals. Of n bytes, SHORT_WRITE=half writes n/2, SHORT_WRITE=random 1 to 4096. Every third write is interrupted first (EINTR).
// At the end the number of calls is appended to the file SHORT_WRITE_COUNT.
#define _GNU_SOURCE
#include <errno.h>
#include <fcntl.h>
#include <stdatomic.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <unistd.h>

static atomic_uint calls, shortened;

ssize_t write(int file, const void *bytes, size_t size) {
    struct stat status;
    const char *mode = getenv("SHORT_WRITE");
    if (file > 2 && size > 1 && mode && fstat(file, &status) == 0 && S_ISREG(status.st_mode)) {
        unsigned number = atomic_fetch_add(&calls, 1);
        if (number % 3 == 2) {
            errno = EINTR;
            return -1;
        }
        // any sequence of sizes: that of a linear congruential generator
        size_t most = strcmp(mode, "half") ? 1 + (number * 1103515245u + 12345u) / 65536 % 4096 : size / 2;
        if (most < size) {
            size = most;
            atomic_fetch_add(&shortened, 1);
        }
    }
    return syscall(SYS_write, file, bytes, size);
}

__attribute__((destructor)) static void report(void) {
    const char *name = getenv("SHORT_WRITE_COUNT");
    FILE *file = name ? fopen(name, "a") : NULL;
    if (file) {
        fprintf(file, "%u\n", (unsigned)shortened);
        fclose(file);
    }
}
