/* Preloaded into linux.uml by with-vcan on processors with AMX.
 *
 * User-Mode Linux keeps the extended register state (XSAVE area) of its processes in a buffer of 2696 bytes and hands
 * it back with PTRACE_SETREGSET. With AMX the area is larger, and the host refuses any other length: the inner init
 * dies at once. So the area is padded with zeros to the host's length, and the components that are not in the buffer
 * (the tiles) are marked as in their initial state.
 */
#define _GNU_SOURCE
#include <errno.h>
#include <stdarg.h>
#include <stdint.h>
#include <string.h>
#include <sys/syscall.h>
#include <sys/uio.h>
#include <unistd.h>

enum {
    PEEK_FIRST = 1, /* PTRACE_PEEKTEXT, _PEEKDATA, _PEEKUSER: the value is the result */
    PEEK_LAST = 3,
    GETREGSET = 0x4204,
    SETREGSET = 0x4205,
    X86_XSTATE = 0x202,
    XSTATE_BV = 512, /* offset of the component bitmap in the XSAVE header */
};
static const uint64_t WITHOUT_TILES = 0x3ff;

static unsigned char area[65536] __attribute__((aligned(64)));
static size_t full;

long ptrace(int request, ...)
{
    va_list arguments;
    va_start(arguments, request);
    long pid = va_arg(arguments, int);
    void *address = va_arg(arguments, void *);
    void *data = va_arg(arguments, void *);
    va_end(arguments);

    if (request == SETREGSET && address == (void *)X86_XSTATE) {
        struct iovec *given = data;
        struct iovec padded = {area, sizeof area};
        if (full == 0) {
            if (syscall(SYS_ptrace, (long)GETREGSET, pid, address, &padded) < 0)
                return -1;
            full = padded.iov_len;
        }
        if (given->iov_len < full) {
            uint64_t components;
            memcpy(area, given->iov_base, given->iov_len);
            memset(area + given->iov_len, 0, full - given->iov_len);
            memcpy(&components, area + XSTATE_BV, sizeof components);
            components &= WITHOUT_TILES;
            memcpy(area + XSTATE_BV, &components, sizeof components);
            padded.iov_len = full;
            return syscall(SYS_ptrace, (long)request, pid, address, &padded);
        }
    }
    if (request >= PEEK_FIRST && request <= PEEK_LAST) {
        /* The system call stores through its fourth argument, the C library returns the value. */
        long value;
        if (syscall(SYS_ptrace, (long)request, pid, address, &value) < 0)
            return -1;
        errno = 0;
        return value;
    }
    return syscall(SYS_ptrace, (long)request, pid, address, data);
}
