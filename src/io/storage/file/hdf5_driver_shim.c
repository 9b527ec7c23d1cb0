/* SPDX-License-Identifier: MIT */
/* HDF5 file driver of the results: the writes of the library wait in memory until all of them are committed.
 *
 * A commit
 *   1. reserves the space on the disk, so that a full disk is detected before the file is changed;
 *   2. saves the pages that it will change in the undo file, if one is kept;
 *   3. writes the part behind the old end of the file, to which nothing refers yet; then the superblock, which contains
 *      the end; then data and chunk indices, index nodes near the root first; last the object headers, which contain
 *      the numbers of rows.
 * A reader that opens the file during a commit, or after a kill, finds every row of the commit before. When a write
 * fails, the old bytes are restored.
 *
 * Rows of a large model are as large as the model in memory: when more than MOST_WAITING bytes wait, data behind the
 * end of the last commit, to which nothing in the file refers yet, is written before the commit.
 *
 * The undo file holds the pages of the results that have changed since the last checkpoint, as they were then. It
 * reaches the disk before the results are changed, so that they can be restored exactly, however the run ended:
 *
 *   header  "RDDAUND2", length of the results then (8 bytes), digest of the checkpoint (32), checksum (8)
 *   count   number of the finished records (8), checksum (8)
 *   record  number of the page (8), checksum (8), the page (4096)          as many as were saved
 *
 * Records behind those that are counted may be unfinished: the results were not changed after them.
 * Numbers are little endian or as the machine has them: an undo file is for the machine that wrote it. */
#define _GNU_SOURCE
#include "hdf5_driver_shim.h"
#include <errno.h>
#include <fcntl.h>
#include <hdf5.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <sys/statvfs.h>
#include <unistd.h>
#if H5_VERSION_GE(1, 13, 0)
#include <H5FDdevelop.h>
#endif

/* Bytes that wait in memory at most, as far as they can be written before their commit. */
enum { MOST_WAITING = 16 << 20 };

/* One write that waits. */
typedef struct {
   haddr_t addr;
   size_t size;
   H5FD_mem_t type;
   unsigned char *bytes;
} piece_t;

/* The file; `base` comes first for the library. */
typedef struct {
   H5FD_t base;
   int fd;
   int writable, abandoned, trial; /* abandoned: nothing is committed */
   haddr_t eoa, eof;  /* end of what the library uses, logical end of the file */
   haddr_t committed; /* length on the disk */
   dev_t device;
   ino_t inode;
   piece_t *pieces; /* by address, without overlap */
   size_t n, room;
   size_t waiting;   /* bytes of all pieces */
   haddr_t early;    /* end of what was written before its commit, 0 nothing */
   size_t most;      /* bytes beyond which data are written early, 0: MOST_WAITING */
   int keeps_all;    /* writing early has failed: the commit reports why */
   rockdda_undo_t undo;
} results_t;

/* Settings of the driver in the access properties. */
typedef struct {
   int trial; /* 1: show the file in its state at a checkpoint and change it in memory only; 2: continue the trial that
                 was closed last */
   unsigned char digest[ROCKDDA_DIGEST]; /* of that checkpoint */
   char undo[4096];                      /* path of the undo file */
} settings_t;

static hid_t driver = -1;

/* The changes of the last trial. */
static results_t last_trial;

/* Place of the first piece that ends behind addr. */
static size_t first_behind(const results_t *file, haddr_t addr)
{
   size_t low = 0, high = file->n;
   while (low < high) {
      size_t middle = low + (high - low) / 2;
      if (file->pieces[middle].addr + file->pieces[middle].size > addr)
         high = middle;
      else
         low = middle + 1;
   }
   return low;
}

/* Insert a copy of some bytes as a new piece at place k. 0 or -1. */
static int insert_piece(results_t *file, size_t k, H5FD_mem_t type, haddr_t addr, size_t size, const unsigned char *bytes)
{
   piece_t *piece;
   if (file->n == file->room) {
      size_t room = file->room ? 2 * file->room : 256;
      piece_t *larger = realloc(file->pieces, room * sizeof *larger);
      if (!larger) return -1;
      file->pieces = larger;
      file->room = room;
   }
   unsigned char *copy = malloc(size);
   if (!copy) return -1;
   memcpy(copy, bytes, size);
   memmove(file->pieces + k + 1, file->pieces + k, (file->n - k) * sizeof *piece);
   piece = file->pieces + k;
   piece->addr = addr;
   piece->size = size;
   piece->type = type;
   piece->bytes = copy;
   file->n++;
   file->waiting += size;
   return 0;
}

static void drop_pieces(results_t *file)
{
   size_t i;
   for (i = 0; i < file->n; i++) free(file->pieces[i].bytes);
   file->n = 0;
   file->waiting = file->most = 0;
}

static herr_t results_write(H5FD_t *base, H5FD_mem_t type, hid_t transfer, haddr_t addr, size_t size,
                            const void *buffer);

/* Overlay the file on the disk with a page of the undo file. 0 or -1. */
static int overlay_page(void *file, uint64_t addr, const unsigned char *bytes, size_t n)
{
   return results_write(file, H5FD_MEM_DEFAULT, H5P_DEFAULT, addr, n, bytes) < 0 ? -1 : 0;
}

static H5FD_t *results_open(const char *name, unsigned flags, hid_t fapl, haddr_t maxaddr)
{
   struct stat info;
   results_t *file;
   const settings_t *settings = H5Pget_driver_info(fapl);
   int trial = settings ? settings->trial : 0, mode = flags & H5F_ACC_RDWR && !trial ? O_RDWR : O_RDONLY, fd;
   uint64_t length;
   (void)maxaddr;
   if (flags & H5F_ACC_TRUNC) mode |= O_TRUNC;
   if (flags & H5F_ACC_CREAT) mode |= O_CREAT;
   if (flags & H5F_ACC_EXCL) mode |= O_EXCL;
   if (mode & O_RDWR) mode |= O_NOFOLLOW; /* never write through a symbolic link */
   fd = open(name, mode | O_CLOEXEC, 0666);
   if (fd < 0) return NULL;
   file = calloc(1, sizeof *file);
   if (!file || fstat(fd, &info) != 0) {
      free(file);
      close(fd);
      return NULL;
   }
   file->fd = fd;
   file->writable = (flags & H5F_ACC_RDWR) != 0;
   file->eof = file->committed = (haddr_t)info.st_size;
   file->device = info.st_dev;
   file->inode = info.st_ino;
   file->undo.fd = -1;
   if (trial) {
      int problem = 0;
      file->trial = file->abandoned = 1;
      if (trial == 2) {
         file->pieces = last_trial.pieces;
         file->n = last_trial.n;
         file->room = last_trial.room;
         file->waiting = last_trial.waiting;
         length = last_trial.eof;
         memset(&last_trial, 0, sizeof last_trial);
      } else {
         length = file->eof;
         problem = rockdda_undo_each_page(settings->undo, settings->digest, &length, overlay_page, file);
         if (length > file->committed) problem = ENODATA; /* shortened by another program */
      }
      if (problem) {
         drop_pieces(file);
         free(file->pieces);
         free(file);
         close(fd);
         return NULL;
      }
      file->eof = length;
   }
   return (H5FD_t *)file;
}

/* Order of writing before the old end of the file. */
static int rank_of(const piece_t *piece)
{
   switch (piece->type) {
   case H5FD_MEM_SUPER: return 0;
   case H5FD_MEM_OHDR: return 1000;
   case H5FD_MEM_BTREE:
      /* "TREE", type, level: HDF5 File Format Specification, version 1 B-trees */
      return piece->size > 5 && memcmp(piece->bytes, "TREE", 4) == 0 ? 500 - piece->bytes[5] : 500;
   default: return 1;
   }
}

static int by_rank(const void *a, const void *b)
{
   const piece_t *one = *(piece_t *const *)a, *other = *(piece_t *const *)b;
   int difference = rank_of(one) - rank_of(other);
   if (difference != 0) return difference;
   return one->addr < other->addr ? -1 : one->addr > other->addr;
}

/* Lengthen the file on the disk. 0 or an errno value. */
static int take_room(int fd, haddr_t from, haddr_t to)
{
   struct statvfs disk;
   if (fallocate(fd, 0, (off_t)from, (off_t)(to - from)) == 0) return 0;
   if (errno != EOPNOTSUPP && errno != ENOSYS && errno != EINTR) return errno;
   if (fstatvfs(fd, &disk) == 0 && (haddr_t)disk.f_bavail * disk.f_frsize < to - from) return ENOSPC;
   return ftruncate(fd, (off_t)to) == 0 ? 0 : errno;
}

/* Write data behind the last commit and keep it no longer. What cannot be written waits for the commit. */
static void write_early(results_t *file)
{
   size_t i, k, from = first_behind(file, file->committed);
   haddr_t end = file->early;
   for (i = from; i < file->n; i++)
      if (file->pieces[i].type == H5FD_MEM_DRAW && file->pieces[i].addr + file->pieces[i].size > end)
         end = file->pieces[i].addr + file->pieces[i].size;
   if (end > file->early && end > file->committed) file->keeps_all = take_room(file->fd, file->committed, end) != 0;
   if (end > file->early) file->early = end;
   for (i = k = from; i < file->n; i++) {
      piece_t *piece = file->pieces + i;
      int is_early = !file->keeps_all && piece->type == H5FD_MEM_DRAW && piece->addr >= file->committed;
      if (is_early && rockdda_write_at(file->fd, piece->bytes, piece->size, piece->addr) != 0) {
         file->keeps_all = 1;
         is_early = 0;
      }
      if (is_early) {
         file->waiting -= piece->size;
         free(piece->bytes);
      } else
         file->pieces[k++] = *piece;
   }
   file->n = k;
   file->most = file->waiting + MOST_WAITING;
}

/* Write the pieces in place. When that fails restore the old bytes; where that fails too, `restore_failed` is set: what
 * was written then remains, and a reader finds its rows. 0 or an errno value. */
static int write_in_place(results_t *file, piece_t **in_place, size_t n, int *restore_failed)
{
   unsigned char **before = calloc(n ? n : 1, sizeof *before);
   size_t done = 0, i;
   int problem = before ? 0 : ENOMEM;
   while (problem == 0 && done < n) {
      piece_t *piece = in_place[done];
      before[done] = malloc(piece->size);
      problem = before[done] ? rockdda_read_at(file->fd, before[done], piece->size, piece->addr) : ENOMEM;
      if (problem) break;
      done++;
      problem = rockdda_write_at(file->fd, piece->bytes, piece->size, piece->addr);
   }
   for (i = done; problem && i-- > 0;)
      if (rockdda_write_at(file->fd, before[i], in_place[i]->size, in_place[i]->addr)) *restore_failed = 1;
   for (i = 0; before && i < n; i++) free(before[i]);
   free(before);
   return problem;
}

/* Write the pieces behind the old end; small neighbours go together. 0 or an errno value. */
static int write_behind(results_t *file, haddr_t old)
{
   enum { LARGEST = 1 << 15 };
   unsigned char *buffer = malloc(LARGEST);
   size_t i = 0, k, used;
   int problem = buffer ? 0 : ENOMEM;
   while (i < file->n && file->pieces[i].addr < old) i++;
   while (i < file->n && !problem) {
      const piece_t *first = file->pieces + i;
      for (k = i, used = 0; k < file->n && file->pieces[k].addr == first->addr + used; k++) {
         if (used + file->pieces[k].size > LARGEST) break;
         memcpy(buffer + used, file->pieces[k].bytes, file->pieces[k].size);
         used += file->pieces[k].size;
      }
      if (used > 0)
         problem = rockdda_write_at(file->fd, buffer, used, first->addr);
      else
         problem = rockdda_write_at(file->fd, first->bytes, first->size, first->addr);
      i = used > 0 ? k : i + 1;
   }
   free(buffer);
   return problem;
}

/* Write all waiting pieces. 0 or an errno value. */
static int commit(results_t *file)
{
   haddr_t old = file->committed, new = file->eof;
   piece_t **in_place;
   size_t i, n = 0;
   int problem = 0, restore_failed = 0;
   /* keep the length that the undo file restores */
   if (file->undo.fd >= 0 && new < file->undo.length) new = file->undo.length;
   if (!file->writable || file->abandoned || (file->n == 0 && new == old)) return 0;
   in_place = malloc((file->n ? file->n : 1) * sizeof *in_place);
   if (!in_place) return ENOMEM;
   for (i = 0; i < file->n; i++)
      if (file->pieces[i].addr < old) in_place[n++] = &file->pieces[i];
   qsort(in_place, n, sizeof *in_place, by_rank);
   if (new > old) problem = take_room(file->fd, old, new);
   for (i = 0; i < n && !problem; i++)
      problem = rockdda_undo_save(&file->undo, file->fd, in_place[i]->addr, in_place[i]->size);
   if (!problem) problem = rockdda_undo_flush(&file->undo);
   if (!problem) problem = write_behind(file, old);
   if (!problem) problem = write_in_place(file, in_place, n, &restore_failed);
   free(in_place);
   if (problem) {
      /* zeros behind the end are harmless */
      if (new > old && !restore_failed && ftruncate(file->fd, (off_t)old) != 0) errno = 0;
      return problem;
   }
   if ((new < old || new < file->early) && ftruncate(file->fd, (off_t)new) != 0) return errno;
   file->committed = new;
   file->early = 0;
   file->keeps_all = 0;
   drop_pieces(file);
   return 0;
}

static herr_t results_close(H5FD_t *base)
{
   results_t *file = (results_t *)base;
   /* The library may have reduced the end of the file while it closes. The file is complete without this last commit,
    * and the library does not survive a failure here: ignore one. */
   if (commit(file) != 0) errno = 0;
   if (file->early > file->committed && ftruncate(file->fd, (off_t)file->committed) != 0) errno = 0;
   if (file->trial) {
      drop_pieces(&last_trial);
      free(last_trial.pieces);
      last_trial = *file;
   } else {
      drop_pieces(file);
      free(file->pieces);
   }
   rockdda_undo_close(&file->undo);
   close(file->fd);
   free(file);
   return 0;
}

static int results_compare(const H5FD_t *one, const H5FD_t *other)
{
   const results_t *a = (const results_t *)one, *b = (const results_t *)other;
   if (a->device != b->device) return a->device < b->device ? -1 : 1;
   if (a->inode != b->inode) return a->inode < b->inode ? -1 : 1;
   return 0;
}

/* No accumulation of metadata: each piece then comes by itself, with its type. */
static herr_t results_query(const H5FD_t *base, unsigned long *flags)
{
   (void)base;
   if (flags) *flags = H5FD_FEAT_AGGREGATE_METADATA | H5FD_FEAT_AGGREGATE_SMALLDATA | H5FD_FEAT_DATA_SIEVE;
   return 0;
}

static haddr_t results_get_eoa(const H5FD_t *base, H5FD_mem_t type)
{
   (void)type;
   return ((const results_t *)base)->eoa;
}

static herr_t results_set_eoa(H5FD_t *base, H5FD_mem_t type, haddr_t addr)
{
   (void)type;
   ((results_t *)base)->eoa = addr;
   return 0;
}

static haddr_t results_get_eof(const H5FD_t *base, H5FD_mem_t type)
{
   (void)type;
   return ((const results_t *)base)->eof;
}

static herr_t results_get_handle(H5FD_t *base, hid_t fapl, void **handle)
{
   (void)fapl;
   if (!handle) return -1;
   *handle = base;
   return 0;
}

static herr_t results_read(H5FD_t *base, H5FD_mem_t type, hid_t transfer, haddr_t addr, size_t size, void *buffer)
{
   results_t *file = (results_t *)base;
   unsigned char *bytes = buffer;
   size_t k;
   (void)type;
   (void)transfer;
   errno = rockdda_read_at(file->fd, bytes, size, addr);
   if (errno) return -1;
   for (k = first_behind(file, addr); k < file->n && file->pieces[k].addr < addr + size; k++) {
      const piece_t *piece = file->pieces + k;
      haddr_t from = piece->addr > addr ? piece->addr : addr, to = piece->addr + piece->size;
      if (to > addr + size) to = addr + size;
      memcpy(bytes + (from - addr), piece->bytes + (from - piece->addr), (size_t)(to - from));
   }
   return 0;
}

static herr_t results_write(H5FD_t *base, H5FD_mem_t type, hid_t transfer, haddr_t addr, size_t size, const void *buffer)
{
   results_t *file = (results_t *)base;
   const unsigned char *bytes = buffer;
   haddr_t end = addr + size;
   size_t k = first_behind(file, addr);
   (void)transfer;
   if (!file->writable) return -1;
   while (addr < end) {
      haddr_t to = end;
      if (k < file->n && file->pieces[k].addr <= addr) { /* over one that waits */
         piece_t *piece = file->pieces + k;
         if (to > piece->addr + piece->size) to = piece->addr + piece->size;
         memcpy(piece->bytes + (addr - piece->addr), bytes, (size_t)(to - addr));
         piece->type = type;
      } else {
         if (k < file->n && to > file->pieces[k].addr) to = file->pieces[k].addr;
         if (insert_piece(file, k, type, addr, (size_t)(to - addr), bytes) != 0) return -1;
      }
      bytes += to - addr;
      addr = to;
      k++;
   }
   if (end > file->eof) file->eof = end;
   if (file->waiting > (file->most ? file->most : MOST_WAITING) && !file->abandoned && !file->keeps_all) write_early(file);
   return 0;
}

static herr_t results_truncate(H5FD_t *base, hid_t transfer, hbool_t closing)
{
   results_t *file = (results_t *)base;
   (void)transfer;
   (void)closing;
   if (file->writable) file->eof = file->eoa;
   return 0;
}

static const H5FD_class_t results_class = {
#if H5_VERSION_GE(1, 13, 0)
   .version = H5FD_CLASS_VERSION,
   .value = (H5FD_class_value_t)601, /* of the range for drivers that are not registered with the HDF Group */
#endif
   .name = "rockdda",
   .maxaddr = (haddr_t)INT64_MAX,
   .fc_degree = H5F_CLOSE_STRONG,
   .fapl_size = sizeof(settings_t),
   .open = results_open,
   .close = results_close,
   .cmp = results_compare,
   .query = results_query,
   .get_eoa = results_get_eoa,
   .set_eoa = results_set_eoa,
   .get_eof = results_get_eof,
   .get_handle = results_get_handle,
   .read = results_read,
   .write = results_write,
   .truncate = results_truncate,
   .fl_map = H5FD_FLMAP_DICHOTOMY,
};

static int set(int64_t access, const settings_t *settings)
{
   if (driver < 0 || H5Iis_valid(driver) <= 0) driver = H5FDregister(&results_class);
   return driver < 0 || H5Pset_driver((hid_t)access, driver, settings) < 0 ? -1 : 0;
}

/* Files opened with these access properties go through this driver. 0 or -1. */
int rockdda_pieces_set(int64_t access)
{
   static const settings_t none;
   return set(access, &none);
}

/* As rockdda_pieces_set, for a trial: the file shows its state at the checkpoint with this digest, or with `again` the
 * changes of the preceding trial, and what is written remains in memory. */
int rockdda_pieces_set_trial(int64_t access, const char *undo, const unsigned char *digest, int again)
{
   settings_t settings;
   memset(&settings, 0, sizeof settings);
   settings.trial = again ? 2 : 1;
   memcpy(settings.digest, digest, ROCKDDA_DIGEST);
   if (strlen(undo) >= sizeof settings.undo) return -1;
   strcpy(settings.undo, undo);
   return set(access, &settings);
}

static results_t *file_of(int64_t id)
{
   void *handle = NULL;
   if (H5Fget_vfd_handle((hid_t)id, H5P_DEFAULT, &handle) < 0) return NULL;
   return handle;
}

/* Write all waiting pieces; the library has been flushed. 0 or an errno value. */
int rockdda_pieces_commit(int64_t id)
{
   results_t *file = file_of(id);
   return file ? commit(file) : EBADF;
}

/* Wait until what was committed is on the disk. 0 or an errno value. */
int rockdda_pieces_sync(int64_t id)
{
   results_t *file = file_of(id);
   if (!file) return EBADF;
   return rockdda_sync(file->fd);
}

static herr_t open_attribute(hid_t owner, const char *name, const H5A_info_t *info, void *nothing)
{
   hid_t attribute = H5Aopen(owner, name, H5P_DEFAULT);
   (void)info;
   (void)nothing;
   return attribute < 0 ? -1 : H5Aclose(attribute);
}

static herr_t open_object(hid_t group, const char *name, const H5L_info_t *info, void *nothing)
{
   hid_t object = H5Oopen(group, name, H5P_DEFAULT);
   herr_t status;
   (void)info;
   if (object < 0) return -1;
   status = H5Aiterate2(object, H5_INDEX_NAME, H5_ITER_INC, NULL, open_attribute, nothing);
   return H5Oclose(object) < 0 ? -1 : status;
}

/* Open all objects and attributes. 0 or -1. */
int rockdda_pieces_walk(int64_t id)
{
   if (H5Aiterate2((hid_t)id, H5_INDEX_NAME, H5_ITER_INC, NULL, open_attribute, NULL) < 0) return -1;
   return H5Lvisit((hid_t)id, H5_INDEX_NAME, H5_ITER_INC, open_object, NULL) < 0 ? -1 : 0;
}

/* Discard all changes from now on, also those at the close. */
void rockdda_pieces_abandon(int64_t id)
{
   results_t *file = file_of(id);
   if (file) file->abandoned = 1;
}

/* Begin an undo file that returns to the present state, that of the checkpoint with this digest; an undo file of that
 * checkpoint is continued. 0 or an errno value. */
int rockdda_pieces_keep_undo(int64_t id, const char *path, const unsigned char *digest)
{
   results_t *file = file_of(id);
   if (!file) return EBADF;
   rockdda_undo_close(&file->undo);
   return rockdda_undo_open(&file->undo, path, digest, file->committed);
}
