/* SPDX-License-Identifier: MIT */
/* Undo files of results: see hdf5_driver_shim.c. */
#define _GNU_SOURCE
#include "hdf5_driver_shim.h"
#include <errno.h>
#include <fcntl.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

enum { COUNT = 8 + 8 + ROCKDDA_DIGEST + 8, HEADER = COUNT + 8 + 8, RECORD = 8 + 8 + ROCKDDA_PAGE };
static const char magic[9] = "RDDAUND2";

int rockdda_read_at(int fd, unsigned char *bytes, size_t n, uint64_t addr)
{
   while (n > 0) {
      ssize_t done = pread(fd, bytes, n, (off_t)addr);
      if (done < 0 && errno == EINTR) continue;
      if (done < 0) return errno;
      if (done == 0) {
         memset(bytes, 0, n);
         return 0;
      }
      bytes += done;
      addr += (uint64_t)done;
      n -= (size_t)done;
   }
   return 0;
}

int rockdda_write_at(int fd, const unsigned char *bytes, size_t n, uint64_t addr)
{
   while (n > 0) {
      ssize_t done = pwrite(fd, bytes, n, (off_t)addr);
      if (done < 0 && errno == EINTR) continue;
      if (done < 0) return errno;
      bytes += done;
      addr += (uint64_t)done;
      n -= (size_t)done;
   }
   return 0;
}

int rockdda_sync(int fd)
{
   if (fsync(fd) == 0 || errno == EINVAL || errno == EROFS || errno == ENOTSUP) return 0;
   return errno;
}

/* FNV-1a, 64 bits */
static uint64_t checksum(const unsigned char *bytes, size_t n, uint64_t sum)
{
   size_t i;
   for (i = 0; i < n; i++) sum = (sum ^ bytes[i]) * 1099511628211u;
   return sum;
}

static const uint64_t start_sum = 14695981039346656037u;

static void put_number(unsigned char *place, uint64_t number)
{
   memcpy(place, &number, sizeof number);
}

static uint64_t get_number(const unsigned char *place)
{
   uint64_t number;
   memcpy(&number, place, sizeof number);
   return number;
}

static uint64_t pages_of(uint64_t length)
{
   return (length + ROCKDDA_PAGE - 1) / ROCKDDA_PAGE;
}

/* Is the fixed part of a header that of an undo file, with a valid checksum? */
static int is_header(const unsigned char *header)
{
   return memcmp(header, magic, 8) == 0 && get_number(header + COUNT - 8) == checksum(header, COUNT - 8, start_sum);
}

/* Is this the undo file of that checkpoint? Its length of the results. */
static int is_of(int fd, const unsigned char *digest, uint64_t *length)
{
   unsigned char header[HEADER];
   if (rockdda_read_at(fd, header, HEADER, 0) != 0) return 0;
   if (!is_header(header) || memcmp(header + 16, digest, ROCKDDA_DIGEST) != 0) return 0;
   *length = get_number(header + 8);
   return 1;
}

/* The number of finished records with its checksum. */
static void put_count(unsigned char *place, uint64_t count)
{
   put_number(place, count);
   put_number(place + 8, checksum(place, 8, start_sum));
}

/* Read record k. 1: valid; 0: the end, or an unfinished record (the results were not changed after it). */
static int read_record(int fd, uint64_t k, unsigned char *record)
{
   struct stat info;
   uint64_t place = HEADER + k * RECORD;
   if (fstat(fd, &info) != 0 || place + RECORD > (uint64_t)info.st_size) return 0;
   if (rockdda_read_at(fd, record, RECORD, place) != 0) return 0;
   return get_number(record + 8) == checksum(record + 16, ROCKDDA_PAGE, checksum(record, 8, start_sum));
}

int rockdda_undo_is_whole(const char *path, const unsigned char *digest, int *whole)
{
   static const unsigned char zeros[HEADER] = {0};
   unsigned char header[HEADER], record[RECORD];
   struct stat info;
   uint64_t k = 0;
   int fd = open(path, O_RDONLY | O_NOFOLLOW | O_CLOEXEC), problem = 0;
   *whole = 1;
   if (fd < 0) return errno == ENOENT ? 0 : errno;
   if (fstat(fd, &info) != 0) problem = errno;
   if (!problem) problem = rockdda_read_at(fd, header, HEADER, 0);
   if (problem) {
      close(fd);
      return problem;
   }
   if (!is_header(header)) {
      /* without a valid header, an empty file is left from a crash of the machine; a longer one is damaged */
      *whole = info.st_size <= HEADER || memcmp(header, zeros, HEADER) == 0;
   } else if (memcmp(header + 16, digest, ROCKDDA_DIGEST) == 0) {
      if (get_number(header + COUNT + 8) != checksum(header + COUNT, 8, start_sum))
         *whole = 0;
      else
         while (*whole && k < get_number(header + COUNT)) *whole = read_record(fd, k++, record);
   }
   close(fd);
   return 0;
}

/* Open or create a file; a symbolic link or a file with several names is replaced, not written to. */
static int open_own(const char *path)
{
   struct stat info;
   int fd = open(path, O_RDWR | O_NOFOLLOW | O_CLOEXEC);
   if (fd >= 0) {
      if (fstat(fd, &info) == 0 && S_ISREG(info.st_mode) && info.st_nlink == 1) return fd;
      close(fd);
   } else if (errno != ENOENT && errno != ELOOP) {
      return -1;
   }
   if (unlink(path) != 0 && errno != ENOENT) return -1;
   return open(path, O_RDWR | O_CREAT | O_EXCL | O_NOFOLLOW | O_CLOEXEC, 0666);
}

int rockdda_undo_open(rockdda_undo_t *undo, const char *path, const unsigned char *digest, uint64_t length)
{
   unsigned char header[HEADER], record[RECORD];
   uint64_t k = 0, page;
   int problem = 0, old;
   undo->fd = open_own(path);
   if (undo->fd < 0) return errno;
   undo->length = length;
   old = is_of(undo->fd, digest, &undo->length);
   undo->saved = calloc(1, (size_t)(pages_of(undo->length) / 8 + 1));
   if (!undo->saved) problem = ENOMEM;
   if (!problem && old) {
      for (; read_record(undo->fd, k, record); k++) {
         page = get_number(record);
         if (page < pages_of(undo->length)) undo->saved[page / 8] |= (unsigned char)(1 << (page % 8));
      }
      if (ftruncate(undo->fd, (off_t)(HEADER + k * RECORD)) != 0) problem = errno;
      undo->count = k;
   } else if (!problem) {
      memcpy(header, magic, 8);
      put_number(header + 8, length);
      memcpy(header + 16, digest, ROCKDDA_DIGEST);
      put_number(header + COUNT - 8, checksum(header, COUNT - 8, start_sum));
      put_count(header + COUNT, 0);
      undo->count = 0;
      if (ftruncate(undo->fd, 0) != 0) problem = errno;
      if (!problem) problem = rockdda_write_at(undo->fd, header, HEADER, 0);
   }
   if (problem) rockdda_undo_close(undo);
   return problem;
}

int rockdda_undo_save(rockdda_undo_t *undo, int fd, uint64_t addr, size_t size)
{
   uint64_t page, first = addr / ROCKDDA_PAGE, last = (addr + size - 1) / ROCKDDA_PAGE;
   if (undo->fd < 0 || size == 0) return 0;
   for (page = first; page <= last && page < pages_of(undo->length); page++) {
      unsigned char *record;
      int problem;
      if (undo->saved[page / 8] & (1 << (page % 8))) continue;
      if (undo->n_waiting + RECORD > undo->room) {
         size_t room = 2 * undo->room + 16 * RECORD;
         unsigned char *larger = realloc(undo->waiting, room);
         if (!larger) return ENOMEM;
         undo->waiting = larger;
         undo->room = room;
      }
      record = undo->waiting + undo->n_waiting;
      put_number(record, page);
      problem = rockdda_read_at(fd, record + 16, ROCKDDA_PAGE, page * ROCKDDA_PAGE);
      if (problem) return problem;
      put_number(record + 8, checksum(record + 16, ROCKDDA_PAGE, checksum(record, 8, start_sum)));
      undo->n_waiting += RECORD;
      undo->saved[page / 8] |= (unsigned char)(1 << (page % 8));
   }
   return 0;
}

int rockdda_undo_flush(rockdda_undo_t *undo)
{
   unsigned char count[16];
   off_t end;
   int problem;
   if (undo->fd < 0 || undo->n_waiting == 0) return 0;
   end = lseek(undo->fd, 0, SEEK_END);
   if (end < 0) return errno;
   problem = rockdda_write_at(undo->fd, undo->waiting, undo->n_waiting, (uint64_t)end);
   if (!problem && fdatasync(undo->fd) != 0 && errno != EINVAL && errno != EROFS && errno != ENOTSUP) problem = errno;
   if (!problem) {
      /* From here on a missing or wrong record is damage. If a crash of the machine keeps this number from the disk, it
       * is too small, which is harmless. */
      put_count(count, undo->count + undo->n_waiting / RECORD);
      problem = rockdda_write_at(undo->fd, count, sizeof count, COUNT);
   }
   if (!problem) {
      undo->count += undo->n_waiting / RECORD;
      undo->n_waiting = 0;
   } else if (ftruncate(undo->fd, end) != 0) {
      errno = 0; /* the rest is no valid record */
   }
   return problem;
}

void rockdda_undo_close(rockdda_undo_t *undo)
{
   if (undo->fd >= 0) close(undo->fd);
   free(undo->saved);
   free(undo->waiting);
   memset(undo, 0, sizeof *undo);
   undo->fd = -1;
}

int rockdda_undo_each_page(const char *path, const unsigned char *digest, uint64_t *length,
                      int (*take)(void *context, uint64_t addr, const unsigned char *bytes, size_t n), void *context)
{
   unsigned char record[RECORD];
   uint64_t k;
   int undo = open(path, O_RDONLY | O_NOFOLLOW | O_CLOEXEC), problem = 0;
   if (undo < 0) return errno == ENOENT ? 0 : errno;
   for (k = 0; is_of(undo, digest, length) && !problem && read_record(undo, k, record); k++) {
      uint64_t page = get_number(record), left;
      if (page >= pages_of(*length)) continue;
      left = *length - page * ROCKDDA_PAGE;
      if (take(context, page * ROCKDDA_PAGE, record + 16, left < ROCKDDA_PAGE ? (size_t)left : ROCKDDA_PAGE) != 0)
         problem = ENOMEM;
   }
   close(undo);
   return problem;
}

/* Return the results to the state of the checkpoint with this digest. `done`: an undo file of that checkpoint was
 * applied. The undo file stays: applying it again is harmless. */
int rockdda_undo_roll_back(const char *results, const char *path, const unsigned char *digest, int *done)
{
   unsigned char record[RECORD];
   struct stat info;
   uint64_t length = 0, k;
   int undo = open(path, O_RDONLY | O_NOFOLLOW | O_CLOEXEC), fd, problem = 0;
   *done = 0;
   if (undo < 0) return errno == ENOENT ? 0 : errno;
   if (!is_of(undo, digest, &length)) {
      close(undo);
      return 0;
   }
   fd = open(results, O_RDWR | O_NOFOLLOW | O_CLOEXEC);
   if (fd < 0 || fstat(fd, &info) != 0) problem = errno;
   if (!problem && (uint64_t)info.st_size < length) problem = ENODATA; /* shortened by another program */
   for (k = 0; !problem && read_record(undo, k, record); k++)
      problem = rockdda_write_at(fd, record + 16, ROCKDDA_PAGE, get_number(record) * ROCKDDA_PAGE);
   if (!problem && ftruncate(fd, (off_t)length) != 0) problem = errno;
   if (!problem) problem = rockdda_sync(fd);
   if (fd >= 0) close(fd);
   close(undo);
   *done = !problem;
   return problem;
}
