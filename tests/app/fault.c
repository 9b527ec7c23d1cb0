/* SPDX-License-Identifier: MIT */
/* To be preloaded: a fault at the n-th call that changes files. FAULT_AT = n; FAULT_KIND = kill (SIGKILL before the
 * call), tear (SIGKILL in the midst of a write that crosses a boundary between pages, which is where the system lets
 * it happen), full (this call and all later ones that need room fail as on a full disk), once (this call alone fails
 * so). FAULT_COUNT = a file that receives the number of calls at the end. */
#define _GNU_SOURCE
#include <dlfcn.h>
#include <errno.h>
#include <fcntl.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/syscall.h>
#include <unistd.h>

static long calls = 0, fault_at = -2;
static int kind = 0;

static void start(void)
{
   const char *at = getenv("FAULT_AT"), *what = getenv("FAULT_KIND");
   fault_at = at ? atol(at) : -1;
   kind = what ? what[0] : 'k';
}

__attribute__((destructor)) static void tell(void)
{
   const char *path = getenv("FAULT_COUNT");
   FILE *file = path ? fopen(path, "w") : NULL;
   if (!file) return;
   fprintf(file, "%ld\n", calls);
   fclose(file);
}

/* 0: go on; 1: fail; 2: tear */
static int meet(int needs_room)
{
   if (fault_at == -2) start();
   calls++;
   if (fault_at < 0 || calls < fault_at) return 0;
   if (calls == fault_at && kind == 'k') raise(SIGKILL);
   if (calls == fault_at && kind == 't') return 2;
   if (!needs_room) return 0;
   if (kind == 'f' || (kind == 'o' && calls == fault_at)) {
      errno = ENOSPC;
      return 1;
   }
   return 0;
}

static ssize_t write_or_not(int fd, const void *bytes, size_t n, off_t place, int positioned)
{
   int fate = fd <= 2 ? 0 : meet(1);
   if (fate == 1) return -1;
   if (fate == 2) {
      off_t boundary = (place + (off_t)n) / 4096 * 4096;
      if (positioned && boundary > place) syscall(SYS_pwrite64, fd, bytes, (size_t)(boundary - place), place);
      raise(SIGKILL);
   }
   return positioned ? syscall(SYS_pwrite64, fd, bytes, n, place) : syscall(SYS_write, fd, bytes, n);
}

ssize_t write(int fd, const void *bytes, size_t n) { return write_or_not(fd, bytes, n, 0, 0); }
ssize_t pwrite(int fd, const void *bytes, size_t n, off_t place) { return write_or_not(fd, bytes, n, place, 1); }
ssize_t pwrite64(int fd, const void *bytes, size_t n, off_t place) { return write_or_not(fd, bytes, n, place, 1); }


int fallocate(int fd, int mode, off_t from, off_t n)
{
   switch (meet(1)) {
   case 1: return -1;
   case 2: raise(SIGKILL);
   }
   return (int)syscall(SYS_fallocate, fd, mode, from, n);
}

int ftruncate(int fd, off_t n)
{
   if (meet(0) == 2) raise(SIGKILL);
   return (int)syscall(SYS_ftruncate, fd, n);
}

int rename(const char *from, const char *to)
{
   if (meet(0) == 2) raise(SIGKILL);
   return (int)syscall(SYS_rename, from, to);
}

int renameat2(int from_folder, const char *from, int to_folder, const char *to, unsigned flags)
{
   if (meet(0) == 2) raise(SIGKILL);
   return (int)syscall(SYS_renameat2, from_folder, from, to_folder, to, flags);
}

int unlink(const char *path)
{
   if (meet(0) == 2) raise(SIGKILL);
   return (int)syscall(SYS_unlink, path);
}

int fsync(int fd)
{
   switch (meet(1)) {
   case 1: return -1;
   case 2: raise(SIGKILL);
   }
   return (int)syscall(SYS_fsync, fd);
}

int fdatasync(int fd)
{
   switch (meet(1)) {
   case 1: return -1;
   case 2: raise(SIGKILL);
   }
   return (int)syscall(SYS_fdatasync, fd);
}
