/* SPDX-License-Identifier: MIT */
/* Thin POSIX shim: create and lock an output file, and check that it was not replaced. A new file is written as
 * PATH.part and renamed when it is readable; nothing is written through a symbolic link. Locks are open-file-description locks:
 * they end with the process, need no file of their own and do not affect readers, which use flock. */
#define _GNU_SOURCE
#include <errno.h>
#include <fcntl.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

enum { OUTPUT_OK = 0, OUTPUT_EXISTS = -1, OUTPUT_BUSY = -2, OUTPUT_SPECIAL = -3, OUTPUT_LINK = -4 };

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
   /* a file system without locks: run without protection */
   return (errno == EAGAIN || errno == EACCES) ? OUTPUT_BUSY : OUTPUT_OK;
}

/* Is the open file still the one that the path names? */
int rockdda_output_is_there(const char *path, int fd)
{
   struct stat by_name, by_handle;
   if (lstat(path, &by_name) != 0 || fstat(fd, &by_handle) != 0) return 0;
   return by_name.st_ino == by_handle.st_ino && by_name.st_dev == by_handle.st_dev;
}

/* Do two paths name one file? */
int rockdda_output_is_same(const char *one, const char *other)
{
   struct stat a, b;
   if (stat(one, &a) != 0 || stat(other, &b) != 0) return 0;
   return a.st_ino == b.st_ino && a.st_dev == b.st_dev;
}

/* Lock an existing file. 0, OUTPUT_BUSY, OUTPUT_LINK or an errno value. */
static int lock_existing(const char *path, int *fd)
{
   int tries;
   for (tries = 0; tries < 100; tries++) {
      *fd = open(path, O_RDWR | O_NOFOLLOW | O_NONBLOCK | O_CLOEXEC);
      if (*fd < 0) return errno == ELOOP ? OUTPUT_LINK : errno;
      if (lock_whole_file(*fd) != OUTPUT_OK) {
         close(*fd);
         return OUTPUT_BUSY;
      }
      if (rockdda_output_is_there(path, *fd)) return OUTPUT_OK;
      close(*fd); /* replaced by another run in between */
   }
   return OUTPUT_BUSY;
}

/* Create and lock a file under a name that only runs use; the file of a killed run is removed first. 0, OUTPUT_BUSY
 * when a running process writes it, or an errno value. */
static int create_part(const char *part, int *fd)
{
   struct stat info;
   int tries, problem, left;
   for (tries = 0; tries < 100; tries++) {
      *fd = open(part, O_RDWR | O_CREAT | O_EXCL | O_NOFOLLOW | O_CLOEXEC, 0666);
      if (*fd >= 0) {
         problem = lock_whole_file(*fd);
         if (problem == OUTPUT_OK && rockdda_output_is_there(part, *fd)) return OUTPUT_OK;
         close(*fd); /* another run has removed it */
         continue;
      }
      if (errno != EEXIST) return errno;
      if (lstat(part, &info) != 0) continue;
      if (S_ISDIR(info.st_mode)) return EISDIR;
      left = -1;
      if (S_ISREG(info.st_mode)) {
         problem = lock_existing(part, &left);
         if (problem == ENOENT) continue;
         if (problem != OUTPUT_OK) return problem;
      }
      problem = unlink(part) == 0 || errno == ENOENT ? 0 : errno;
      if (left >= 0) close(left);
      if (problem) return problem;
   }
   return OUTPUT_BUSY;
}

/* Begin an output file: create and lock `part`. A file at `path` is an error without force; with it the file stays,
 * locked as `old`, until the new one replaces it, unless a running process writes it. 0, OUTPUT_EXISTS, OUTPUT_BUSY,
 * OUTPUT_SPECIAL or an errno value. */
int rockdda_output_create(const char *path, const char *part, int force, int *fd, int *old)
{
   struct stat info;
   int problem;
   *fd = *old = -1;
   if (lstat(path, &info) == 0) {
      if (S_ISDIR(info.st_mode)) return EISDIR;
      /* /dev/null, a pipe: must not be removed */
      if (!S_ISREG(info.st_mode) && !S_ISLNK(info.st_mode)) return OUTPUT_SPECIAL;
      if (!force) return OUTPUT_EXISTS;
      if (S_ISREG(info.st_mode)) {
         problem = lock_existing(path, old);
         if (problem != OUTPUT_OK) return problem;
      }
   }
   problem = create_part(part, fd);
   if (problem != OUTPUT_OK && *old >= 0) {
      close(*old);
      *old = -1;
   }
   return problem;
}

/* Rename `part` to `path`; an existing file is replaced with force only. 0, OUTPUT_EXISTS or an errno value. */
int rockdda_output_publish(const char *part, const char *path, int force)
{
   struct stat info;
   if (force) return rename(part, path) == 0 ? OUTPUT_OK : errno;
#ifdef RENAME_NOREPLACE
   if (renameat2(AT_FDCWD, part, AT_FDCWD, path, RENAME_NOREPLACE) == 0) return OUTPUT_OK;
   if (errno != EINVAL && errno != ENOSYS) return errno == EEXIST ? OUTPUT_EXISTS : errno;
#endif
   /* a file system that cannot do that in one step */
   if (lstat(path, &info) == 0) return OUTPUT_EXISTS;
   return rename(part, path) == 0 ? OUTPUT_OK : errno;
}

/* Lock a file that is continued. 0, OUTPUT_BUSY, OUTPUT_LINK or an errno value. */
int rockdda_output_reopen(const char *path, int *fd)
{
   return lock_existing(path, fd);
}

/* Unlock. */
void rockdda_output_release(int fd)
{
   if (fd >= 0) close(fd);
}

/* The system's message for an errno value, cut to size - 1 characters. */
void rockdda_errno_text(int code, char *text, int size)
{
   const char *words = code == ELOOP ? "this is a symbolic link, and nothing is written through it" : strerror(code);
   strncpy(text, words, (size_t)size - 1);
   text[size - 1] = '\0';
}
