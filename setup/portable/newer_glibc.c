// What g++ 12 and Debian 12's static libraries take from a glibc newer than 2.31. Part of every binary of the Python package.
#define _GNU_SOURCE
#include <signal.h>
#include <stddef.h>
#include <unistd.h>

#define HIDDEN __attribute__((visibility("hidden")))

// Since 2.32 it says whether a process has a single thread. Without that, counters of references are always atomic.
HIDDEN char __libc_single_threaded = 0;

// Since 2.36; expat's salt, libzip's names of temporary files.
HIDDEN void arc4random_buf(void* buffer, size_t size) {
  char* rest = buffer;
  while (size > 0) {
    const size_t piece = size < 256 ? size : 256;
    if (getentropy(rest, piece) != 0) __builtin_trap();
    rest += piece;
    size -= piece;
  }
}
HIDDEN unsigned arc4random(void) {
  unsigned number;
  arc4random_buf(&number, sizeof number);
  return number;
}

// Since 2.34; what closes the files of Python's child processes. A kernel without it says so.
HIDDEN int close_range(unsigned first, unsigned last, int flags) { return (int)syscall(436, first, last, flags); }

// Since 2.32.
HIDDEN const char* sigabbrev_np(int signal) {
#define NAME(name) \
  case SIG##name: return #name;
  switch (signal) {
    NAME(HUP) NAME(INT) NAME(QUIT) NAME(ILL) NAME(TRAP) NAME(ABRT) NAME(BUS) NAME(FPE) NAME(KILL) NAME(USR1) NAME(SEGV)
    NAME(USR2) NAME(PIPE) NAME(ALRM) NAME(TERM) NAME(STKFLT) NAME(CHLD) NAME(CONT) NAME(STOP) NAME(TSTP) NAME(TTIN)
    NAME(TTOU) NAME(URG) NAME(XCPU) NAME(XFSZ) NAME(VTALRM) NAME(PROF) NAME(WINCH) NAME(POLL) NAME(PWR) NAME(SYS)
    default: return NULL;
  }
}
