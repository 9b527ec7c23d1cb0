/* SPDX-License-Identifier: MIT */
/* Thin POSIX shim: write text and learn when it fails (the Fortran run-time library does not tell of a full disk). */
#define _GNU_SOURCE
#include <errno.h>
#include <fcntl.h>
#include <unistd.h>

/* Create or empty a file for writing, or go on at its end; the descriptor, or minus an errno value. */
int rockdda_sink_open(const char *path, int append)
{
   int fd = open(path, O_WRONLY | O_CREAT | (append ? O_APPEND : O_TRUNC) | O_CLOEXEC, 0666);
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

/* Close, after handing everything to the disk when asked to. 0 or an errno value. */
int rockdda_sink_close(int fd, int sync)
{
   int problem = 0;
   if (sync && fsync(fd) != 0 && errno != EINVAL && errno != EROFS && errno != ENOTSUP) problem = errno;
   if (close(fd) != 0 && problem == 0) problem = errno;
   return problem;
}
