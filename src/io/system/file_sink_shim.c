/* SPDX-License-Identifier: MIT */
/* Thin POSIX shim: write text and report failures (the Fortran run-time library does not report a full disk). */
#define _GNU_SOURCE
#include <errno.h>
#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

enum { NEW_FILE = 0, AT_END = 1, IN_PLACE = 2 };

/* Open for writing: a new file that replaces an existing one (a link is replaced, not followed), the end of a file (not
 * through a link), or the target of the path, a device or a pipe. The descriptor, or minus an errno value. */
int rockdda_sink_open(const char *path, int how)
{
   struct stat info;
   int mode = O_WRONLY | O_CREAT | O_CLOEXEC, fd;
   if (how == NEW_FILE) {
      if (lstat(path, &info) == 0) {
         if (S_ISDIR(info.st_mode)) return -EISDIR;
         if ((S_ISREG(info.st_mode) || S_ISLNK(info.st_mode)) && unlink(path) != 0) return -errno;
      }
      mode |= O_EXCL | O_NOFOLLOW;
   } else {
      mode |= how == AT_END ? O_APPEND | O_NOFOLLOW : O_TRUNC;
   }
   fd = open(path, mode, 0666);
   return fd < 0 ? -errno : fd;
}

/* Write all bytes. 0 or an errno value. */
int rockdda_sink_write(int fd, const char *bytes, long long n)
{
   while (n > 0) {
      ssize_t done = write(fd, bytes, (size_t)n);
      if (done < 0) {
         if (errno == EINTR) continue;
         return errno;
      }
      bytes += done;
      n -= done;
   }
   return 0;
}

/* Close; with `sync` wait until everything is on the disk. 0 or an errno value. */
int rockdda_sink_close(int fd, int sync)
{
   int problem = 0;
   if (sync && fsync(fd) != 0 && errno != EINVAL && errno != EROFS && errno != ENOTSUP) problem = errno;
   if (close(fd) != 0 && problem == 0) problem = errno;
   return problem;
}
