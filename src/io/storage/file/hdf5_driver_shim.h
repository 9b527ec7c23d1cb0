/* SPDX-License-Identifier: MIT */
/* Undo files of results, for hdf5_driver_shim.c; the format is described there. All functions return 0 or an errno
 * value. */
#ifndef ROCKDDA_HDF5_DRIVER_SHIM_H
#define ROCKDDA_HDF5_DRIVER_SHIM_H
#include <stddef.h>
#include <stdint.h>

enum { ROCKDDA_PAGE = 4096, ROCKDDA_DIGEST = 32 };

typedef struct {
   int fd;               /* -1: no undo file is kept */
   uint64_t length;      /* of the results at the checkpoint */
   uint64_t count;       /* finished records */
   unsigned char *saved; /* one bit for each page */
   unsigned char *waiting;
   size_t n_waiting, room;
} rockdda_undo_t;

/* Is the undo file of that checkpoint undamaged? One that is missing, or of another checkpoint, counts as undamaged. */
int rockdda_undo_is_whole(const char *path, const unsigned char *digest, int *whole);

/* Continue the undo file of this checkpoint, or begin one whose state is the present one. */
int rockdda_undo_open(rockdda_undo_t *undo, const char *path, const unsigned char *digest, uint64_t length);

/* Save the pages that hold these bytes, unless they are saved; `fd` is the results. Nothing happens without a file. */
int rockdda_undo_save(rockdda_undo_t *undo, int fd, uint64_t addr, size_t size);

/* Write the saved pages to the disk and wait for it. */
int rockdda_undo_flush(rockdda_undo_t *undo);

void rockdda_undo_close(rockdda_undo_t *undo);

/* Call `take` for every page of the undo file of that checkpoint (the bytes within the length of the results then), and
 * return that length. Without such a file nothing happens. */
int rockdda_undo_each_page(const char *path, const unsigned char *digest, uint64_t *length,
                      int (*take)(void *context, uint64_t addr, const unsigned char *bytes, size_t n), void *context);

/* Read or write at an address of a file; bytes behind its end read as zeros. */
int rockdda_read_at(int fd, unsigned char *bytes, size_t n, uint64_t addr);
int rockdda_write_at(int fd, const unsigned char *bytes, size_t n, uint64_t addr);

/* fsync, where the file system has it. */
int rockdda_sync(int fd);

#endif
