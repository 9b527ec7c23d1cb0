/* SPDX-License-Identifier: MIT */
/* Thin POSIX shim: finish a file under a temporary name and put it in the place of another in one step. */
#define _GNU_SOURCE
#include <errno.h>
#include <fcntl.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

static int sync_it(int fd)
{
   return fsync(fd) == 0 || errno == EINVAL || errno == EROFS || errno == ENOTSUP ? 0 : errno;
}

/* Create an empty file in the place of what is there: a link is replaced, not followed. 0 or an errno value. */
int rockdda_checkpoint_begin(const char *path)
{
   int fd;
   if (unlink(path) != 0 && errno != ENOENT) return errno;
   fd = open(path, O_WRONLY | O_CREAT | O_EXCL | O_NOFOLLOW | O_CLOEXEC, 0666);
   if (fd < 0) return errno;
   return close(fd) == 0 ? 0 : errno;
}

/* Append n bytes, and wait until the file is on the disk. 0 or an errno value. */
int rockdda_checkpoint_seal(const char *path, const char *bytes, int n)
{
   int fd = open(path, O_WRONLY | O_APPEND | O_NOFOLLOW | O_CLOEXEC), problem = 0;
   ssize_t done;
   if (fd < 0) return errno;
   done = write(fd, bytes, (size_t)n);
   if (done != n) problem = done < 0 ? errno : ENOSPC;
   if (!problem) problem = sync_it(fd);
   if (close(fd) != 0 && !problem) problem = errno;
   return problem;
}

/* Replace `to` by `from`; wait until the folder on the disk says so. 0 or an errno value. */
int rockdda_checkpoint_replace(const char *from, const char *to)
{
   char *folder, *slash;
   int fd, problem = 0;
   if (rename(from, to) != 0) return errno;
   folder = strdup(to);
   if (!folder) return ENOMEM;
   slash = strrchr(folder, '/');
   if (slash == folder) slash[1] = '\0';
   else if (slash) slash[0] = '\0';
   fd = open(slash ? folder : ".", O_RDONLY | O_DIRECTORY | O_CLOEXEC);
   free(folder);
   if (fd < 0) return 0; /* a folder that cannot be opened cannot be waited for */
   problem = sync_it(fd);
   close(fd);
   return problem;
}
