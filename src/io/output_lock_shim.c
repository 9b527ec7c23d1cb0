/* SPDX-License-Identifier: MIT */
/* Thin POSIX shim: create an output file that nobody else writes, see that it is still there.
 * Locks are open-file-description locks: they die with the process, leave no file behind and do not disturb
 * readers, which use flock. */
#define _GNU_SOURCE
#include <errno.h>
#include <fcntl.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

enum { OUTPUT_OK = 0, OUTPUT_EXISTS = -1, OUTPUT_BUSY = -2, OUTPUT_SPECIAL = -3 };

static int lock_whole_file(int fd)
{
   struct flock lock;
   memset(&lock, 0, sizeof lock);
   lock.l_type = F_WRLCK;
   lock.l_whence = SEEK_SET;
#ifdef F_OFD_SETLK
   if (fcntl(fd, F_OFD_SETLK, &lock) == 0) return OUTPUT_OK;
#else
   if (fcntl(fd, F_SETLK, &lock) == 0) return OUTPUT_OK;
#endif
   /* a file system without locks: go on unprotected rather than refuse to run */
   return (errno == EAGAIN || errno == EACCES) ? OUTPUT_BUSY : OUTPUT_OK;
}

/* Is the open file still the one that the path names? */
int rockdda_output_is_there(const char *path, int fd)
{
   struct stat by_name, by_handle;
   if (stat(path, &by_name) != 0 || fstat(fd, &by_handle) != 0) return 0;
   return by_name.st_ino == by_handle.st_ino && by_name.st_dev == by_handle.st_dev;
}

/* Do two paths name one file? */
int rockdda_output_is_same(const char *one, const char *other)
{
   struct stat a, b;
   if (stat(one, &a) != 0 || stat(other, &b) != 0) return 0;
   return a.st_ino == b.st_ino && a.st_dev == b.st_dev;
}

/* Lock an existing file. 0, OUTPUT_BUSY or an errno value. */
static int lock_existing(const char *path, int *fd)
{
   int tries;
   for (tries = 0; tries < 100; tries++) {
      *fd = open(path, O_RDWR | O_CLOEXEC);
      if (*fd < 0) return errno;
      if (lock_whole_file(*fd) != OUTPUT_OK) {
         close(*fd);
         return OUTPUT_BUSY;
      }
      if (rockdda_output_is_there(path, *fd)) return OUTPUT_OK;
      close(*fd); /* replaced by another run in between */
   }
   return OUTPUT_BUSY;
}

/* Create and lock a new file; with force an existing one is removed first, unless a running process writes it. Where
 * the path is a link the file is that to which it leads, and the link stays. 0, OUTPUT_EXISTS, OUTPUT_BUSY,
 * OUTPUT_SPECIAL or an errno value. */
int rockdda_output_create(const char *path, int force, int *fd)
{
   struct stat info;
   int old = -1, problem, exclusive = O_EXCL;
   char *target = NULL;
   *fd = -1;
   if (stat(path, &info) == 0) {
      if (S_ISDIR(info.st_mode)) return EISDIR;
      if (!S_ISREG(info.st_mode)) return OUTPUT_SPECIAL; /* /dev/null, a pipe: not to be removed by anybody */
      if (!force) return OUTPUT_EXISTS;
      problem = lock_existing(path, &old);
      if (problem != OUTPUT_OK) return problem;
      target = realpath(path, NULL);
      if (!target || unlink(target) != 0) {
         problem = errno;
         free(target);
         close(old);
         return problem;
      }
   } else if (lstat(path, &info) == 0) {
      exclusive = 0; /* a link to a file that is not there yet */
   }
   *fd = open(target ? target : path, O_RDWR | O_CREAT | exclusive | O_CLOEXEC, 0666);
   problem = *fd < 0 ? (errno == EEXIST ? OUTPUT_EXISTS : errno) : lock_whole_file(*fd);
   free(target);
   if (old >= 0) close(old);
   return problem;
}

/* Lock a file that is to be continued. 0, OUTPUT_BUSY or an errno value. */
int rockdda_output_reopen(const char *path, int *fd)
{
   return lock_existing(path, fd);
}

/* Unlock. */
void rockdda_output_release(int fd)
{
   if (fd >= 0) close(fd);
}

/* The system's words for an errno value, cut to size - 1 characters. */
void rockdda_errno_text(int code, char *text, int size)
{
   const char *words = strerror(code);
   strncpy(text, words, (size_t)size - 1);
   text[size - 1] = '\0';
}
