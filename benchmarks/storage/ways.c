/* SPDX-License-Identifier: MIT */
/* Prototypes of six ways to write results that survive a kill. scripts/compare_storage builds and measures them;
 * docs/notes/design.md holds the table.
 *
 *     ways WAY BLOCKS FRAMES STEPS_PER_FRAME FRAMES_PER_CHECKPOINT
 *
 * writes tables like those of a run to out.h5 in the current folder: one flush per frame, with a checkpoint (flush and
 * fsync) every FRAMES_PER_CHECKPOINT frames. After each flush one line with the number of frames goes to descriptor 3,
 * if that is open. With WAYS_CLOSE in the environment a failure closes the file as a library would. Values follow from
 * the row number, so that a reader can verify every row.
 *
 *   plain     one file, H5Fflush
 *   swmr      one file in HDF5's SWMR mode
 *   segments  one closed file per flush, a main file with virtual datasets, merged at the end
 *   copy      each flush: copy out.h5, append to the copy, rename
 *   swap      each flush: append to the second of two files, rename it to out.h5
 *   driver    the file driver and the undo file of src/io/storage */
#define _GNU_SOURCE
#include <fcntl.h>
#include <hdf5.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <time.h>
#include <unistd.h>

int rockdda_pieces_set(int64_t access);
int rockdda_pieces_commit(int64_t id);
int rockdda_pieces_sync(int64_t id);
int rockdda_pieces_keep_undo(int64_t id, const char *path, const unsigned char *digest);
void rockdda_pieces_abandon(int64_t id);

enum { N_TABLES = 8, MOST_SEGMENTS = 4096 };

typedef struct {
   const char *name;
   int is_real, per_step; /* rows: one per step, else `rows` per frame */
   hsize_t rows, width;
} table_t;

static table_t tables[N_TABLES] = {
   { "history/step", 0, 1, 1, 1 },      { "history/time", 1, 1, 1, 1 },     { "history/energy", 1, 1, 1, 10 },
   { "frames/vertices", 1, 0, 1, 0 },   { "frames/stress", 1, 0, 1, 0 },    { "frames/velocity", 1, 0, 1, 0 },
   { "frames/contact_force", 1, 0, 0, 4 }, { "frames/contact_blocks", 0, 0, 0, 2 },
};
static hsize_t steps_per_frame;
static hid_t open_file = -1; /* that rows are appended to */
static int has_driver;

/* Exit with code 5; with WAYS_CLOSE close the file first, as a library must. */
static void fail(const char *what)
{
   fprintf(stderr, "ways: %s failed\n", what);
   if (!getenv("WAYS_CLOSE")) _exit(5);
   if (has_driver) rockdda_pieces_abandon(open_file);
   if (H5Fclose(open_file) < 0) fprintf(stderr, "ways: close failed too\n");
   H5close();
   exit(5);
}

static void need(int64_t status, const char *what)
{
   if (status < 0) fail(what);
}

static hsize_t rows_until(const table_t *t, hsize_t frames)
{
   return t->per_step ? frames * steps_per_frame : frames * t->rows;
}

static hsize_t chunk_rows(const table_t *t)
{
   hsize_t n = 4096 / ((t->is_real ? 8 : 4) * t->width);
   return n < 1 ? 1 : n > 1024 ? 1024 : n;
}

/* Rows [first, first + n) of a table: a slowly moving position with some digits of noise. */
static void *make_rows(const table_t *t, hsize_t first, hsize_t n)
{
   size_t count = (size_t)(n * t->width), i;
   void *rows = malloc((count ? count : 1) * 8);
   for (i = 0; i < count; i++) {
      uint64_t row = first + i / t->width, place = i % t->width, noise = (row * 1000003 + place) * 0x9e3779b97f4a7c15u;
      if (t->is_real)
         ((double *)rows)[i] = 0.37 * (double)place + 1e-3 * (double)row + (double)(noise >> 40) * 1e-12;
      else
         ((int32_t *)rows)[i] = (int32_t)(row + place);
   }
   return rows;
}

static hid_t value_type(const table_t *t)
{
   return t->is_real ? H5T_IEEE_F64LE : H5T_STD_I32LE;
}

static void create_tables(hid_t file)
{
   int i;
   need(H5Gclose(H5Gcreate2(file, "history", H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT)), "group");
   need(H5Gclose(H5Gcreate2(file, "frames", H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT)), "group");
   for (i = 0; i < N_TABLES; i++) {
      const table_t *t = tables + i;
      hsize_t dims[2] = { 0, t->width }, most[2] = { H5S_UNLIMITED, t->width }, chunk[2] = { chunk_rows(t), t->width };
      hid_t space = H5Screate_simple(2, dims, most), create = H5Pcreate(H5P_DATASET_CREATE);
      H5Pset_chunk(create, 2, chunk);
      H5Pset_shuffle(create);
      H5Pset_deflate(create, 1);
      need(H5Dclose(H5Dcreate2(file, t->name, value_type(t), space, H5P_DEFAULT, create, H5P_DEFAULT)), "dataset");
      H5Pclose(create);
      H5Sclose(space);
   }
}

static void write_rows(hid_t set, const table_t *t, hsize_t place, hsize_t first, hsize_t n)
{
   hsize_t start[2] = { place, 0 }, count[2] = { n, t->width };
   hid_t space = H5Dget_space(set), memory = H5Screate_simple(2, count, NULL);
   void *rows = make_rows(t, first, n);
   H5Sselect_hyperslab(space, H5S_SELECT_SET, start, NULL, count, NULL);
   need(H5Dwrite(set, t->is_real ? H5T_NATIVE_DOUBLE : H5T_NATIVE_INT32, memory, space, H5P_DEFAULT, rows), "write");
   free(rows);
   H5Sclose(memory);
   H5Sclose(space);
}

/* Rows of the frames [from, to), behind those of `before` frames that are not in this file. `begun_plain`: the last
 * chunk, while it is not complete, goes in unpacked, so that it keeps its place (see series.f90). */
static void append(hid_t file, hsize_t from, hsize_t to, hsize_t before, int begun_plain)
{
   int i;
   open_file = file;
   for (i = 0; i < N_TABLES; i++) {
      const table_t *t = tables + i;
      hsize_t a = rows_until(t, from), b = rows_until(t, to), skip = rows_until(t, before), per = chunk_rows(t);
      hsize_t size[2] = { b - skip, t->width };
      hid_t set = H5Dopen2(file, t->name, H5P_DEFAULT);
      need(H5Dset_extent(set, size), "extent");
      while (begun_plain && a < b) {
         hsize_t chunk = a / per * per, end = chunk + per < b ? chunk + per : b, place[2] = { chunk, 0 };
         size_t bytes = (size_t)(per * t->width) * (t->is_real ? 8 : 4);
         if (a == chunk && b >= chunk + per) { /* complete chunks go through the filters */
            end = chunk + (b - chunk) / per * per;
            write_rows(set, t, chunk, chunk, end - chunk);
         } else {
            void *rows = make_rows(t, chunk, per);
            memset((char *)rows + (end - chunk) * t->width * (t->is_real ? 8 : 4), 0, bytes - (end - chunk) * t->width * (t->is_real ? 8 : 4));
            need(H5Dwrite_chunk(set, H5P_DEFAULT, 3, place, bytes, rows), "write chunk");
            free(rows);
         }
         a = end;
      }
      if (!begun_plain && a < b) write_rows(set, t, a - skip, a, b - a);
      need(H5Dclose(set), "close dataset");
   }
}

static void sync_path(const char *path)
{
   int fd = open(path, O_RDONLY);
   if (fd < 0 || fsync(fd) != 0) fail("fsync");
   close(fd);
}

static void copy_file(const char *from, const char *to)
{
   int in = open(from, O_RDONLY), out = open(to, O_RDWR | O_CREAT | O_TRUNC, 0666);
   ssize_t n;
   if (in < 0 || out < 0) fail("open");
   while ((n = copy_file_range(in, NULL, out, NULL, 1 << 30, 0)) > 0) continue;
   if (n < 0) fail("copy");
   close(in);
   close(out);
}

static void committed(hsize_t frames)
{
   char text[32];
   int n = snprintf(text, sizeof text, "%llu\n", (unsigned long long)frames);
   if (write(3, text, (size_t)n) < 0) return;
}

/* plain, swmr, driver */
static void run_one(const char *way, hsize_t frames, hsize_t per_checkpoint)
{
   int driver = !strcmp(way, "driver"), swmr = !strcmp(way, "swmr");
   unsigned char digest[32] = { 0 };
   hid_t access = H5Pcreate(H5P_FILE_ACCESS), file;
   hsize_t k;
   if (swmr) H5Pset_libver_bounds(access, H5F_LIBVER_LATEST, H5F_LIBVER_LATEST);
   has_driver = driver;
   if (driver && rockdda_pieces_set(access) != 0) fail("driver");
   file = H5Fcreate("out.h5", H5F_ACC_TRUNC, H5P_DEFAULT, access);
   need(file, "create");
   create_tables(file);
   need(H5Fflush(file, H5F_SCOPE_GLOBAL), "flush");
   if (swmr) need(H5Fstart_swmr_write(file), "swmr");
   if (driver && rockdda_pieces_commit(file) != 0) fail("commit");
   for (k = 1; k <= frames; k++) {
      append(file, k - 1, k, 0, driver);
      need(H5Fflush(file, H5F_SCOPE_GLOBAL), "flush");
      if (driver && rockdda_pieces_commit(file) != 0) fail("commit");
      if (k % per_checkpoint == 0) {
         sync_path("out.h5");
         digest[0]++;
         if (driver && rockdda_pieces_keep_undo(file, "out.h5.undo", digest) != 0) fail("undo");
      }
      committed(k);
   }
   need(H5Fclose(file), "close");
   sync_path("out.h5");
   unlink("out.h5.undo");
}

static void run_copy(hsize_t frames)
{
   hsize_t k;
   hid_t file = H5Fcreate("out.h5", H5F_ACC_TRUNC, H5P_DEFAULT, H5P_DEFAULT);
   create_tables(file);
   need(H5Fclose(file), "close");
   for (k = 1; k <= frames; k++) {
      copy_file("out.h5", "out.h5.part");
      file = H5Fopen("out.h5.part", H5F_ACC_RDWR, H5P_DEFAULT);
      need(file, "open");
      append(file, k - 1, k, 0, 0);
      need(H5Fclose(file), "close");
      sync_path("out.h5.part");
      if (rename("out.h5.part", "out.h5") != 0) fail("rename");
      committed(k);
   }
}

static void run_swap(hsize_t frames)
{
   const char *other = "out.h5.other", *spare = "out.h5.part";
   hid_t file[2];
   hsize_t done[2] = { 0, 0 }, k;
   int i;
   for (i = 0; i < 2; i++) {
      file[i] = H5Fcreate(i ? other : "out.h5", H5F_ACC_TRUNC, H5P_DEFAULT, H5P_DEFAULT);
      need(file[i], "create");
      create_tables(file[i]);
      need(H5Fflush(file[i], H5F_SCOPE_GLOBAL), "flush");
   }
   for (k = 1, i = 1; k <= frames; k++, i = !i) {
      append(file[i], done[i], k, 0, 0);
      done[i] = k;
      need(H5Fflush(file[i], H5F_SCOPE_GLOBAL), "flush");
      sync_path(other);
      /* out.h5 keeps a second name, then the other file takes its place */
      if (link("out.h5", spare) != 0 || rename(other, "out.h5") != 0 || rename(spare, other) != 0) fail("swap");
      committed(k);
   }
   need(H5Fclose(file[i]), "close");
   need(H5Fclose(file[!i]), "close");
   unlink(other);
}

/* The main file: virtual datasets over all segments; under another name first. */
static void write_main(hsize_t n, const hsize_t *end)
{
   hid_t file = H5Fcreate("out.h5.part", H5F_ACC_TRUNC, H5P_DEFAULT, H5P_DEFAULT);
   hsize_t k;
   int i;
   need(H5Gclose(H5Gcreate2(file, "history", H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT)), "group");
   need(H5Gclose(H5Gcreate2(file, "frames", H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT)), "group");
   for (i = 0; i < N_TABLES; i++) {
      const table_t *t = tables + i;
      hsize_t dims[2] = { rows_until(t, n ? end[n - 1] : 0), t->width };
      hid_t space = H5Screate_simple(2, dims, NULL), create = H5Pcreate(H5P_DATASET_CREATE);
      for (k = 0; k < n; k++) {
         hsize_t first = rows_until(t, k ? end[k - 1] : 0), start[2] = { first, 0 };
         hsize_t count[2] = { rows_until(t, end[k]) - first, t->width };
         hid_t part = H5Screate_simple(2, count, NULL);
         char name[40];
         snprintf(name, sizeof name, "out.h5.%04llu", (unsigned long long)k);
         H5Sselect_hyperslab(space, H5S_SELECT_SET, start, NULL, count, NULL);
         need(H5Pset_virtual(create, space, name, t->name, part), "virtual");
         H5Sclose(part);
      }
      need(H5Dclose(H5Dcreate2(file, t->name, value_type(t), space, H5P_DEFAULT, create, H5P_DEFAULT)), "dataset");
      H5Pclose(create);
      H5Sclose(space);
   }
   need(H5Fclose(file), "close");
   sync_path("out.h5.part");
   if (rename("out.h5.part", "out.h5") != 0) fail("rename");
}

static void run_segments(hsize_t frames)
{
   static hsize_t end[MOST_SEGMENTS];
   hsize_t k, first;
   hid_t file, whole;
   char name[40];
   int i;
   for (k = 1; k <= frames; k++) {
      snprintf(name, sizeof name, "out.h5.%04llu", (unsigned long long)(k - 1));
      file = H5Fcreate(name, H5F_ACC_TRUNC, H5P_DEFAULT, H5P_DEFAULT);
      create_tables(file);
      append(file, k - 1, k, k - 1, 0);
      need(H5Fclose(file), "close");
      sync_path(name);
      end[k - 1] = k;
      write_main(k, end);
      committed(k);
   }
   /* merge */
   whole = H5Fcreate("out.h5.part", H5F_ACC_TRUNC, H5P_DEFAULT, H5P_DEFAULT);
   create_tables(whole);
   for (k = 0; k < frames; k++) {
      snprintf(name, sizeof name, "out.h5.%04llu", (unsigned long long)k);
      file = H5Fopen(name, H5F_ACC_RDONLY, H5P_DEFAULT);
      for (i = 0; i < N_TABLES; i++) {
         const table_t *t = tables + i;
         hid_t from = H5Dopen2(file, t->name, H5P_DEFAULT), to = H5Dopen2(whole, t->name, H5P_DEFAULT), space, memory;
         hid_t type = t->is_real ? H5T_NATIVE_DOUBLE : H5T_NATIVE_INT32;
         hsize_t start[2] = { first = rows_until(t, k), 0 }, count[2] = { rows_until(t, k + 1) - first, t->width };
         hsize_t size[2] = { first + count[0], t->width };
         void *rows = malloc((size_t)(count[0] * t->width) * 8);
         need(H5Dread(from, type, H5S_ALL, H5S_ALL, H5P_DEFAULT, rows), "read");
         need(H5Dset_extent(to, size), "extent");
         space = H5Dget_space(to);
         memory = H5Screate_simple(2, count, NULL);
         H5Sselect_hyperslab(space, H5S_SELECT_SET, start, NULL, count, NULL);
         need(H5Dwrite(to, type, memory, space, H5P_DEFAULT, rows), "write");
         free(rows);
         H5Sclose(memory);
         H5Sclose(space);
         H5Dclose(from);
         H5Dclose(to);
      }
      H5Fclose(file);
   }
   need(H5Fclose(whole), "close");
   sync_path("out.h5.part");
   if (rename("out.h5.part", "out.h5") != 0) fail("rename");
   for (k = 0; k < frames; k++) {
      snprintf(name, sizeof name, "out.h5.%04llu", (unsigned long long)k);
      unlink(name);
   }
}

int main(int n, char **arguments)
{
   hsize_t blocks, frames, per_checkpoint;
   struct timespec a, b, cpu;
   if (n != 6) fail("usage: ways WAY BLOCKS FRAMES STEPS_PER_FRAME FRAMES_PER_CHECKPOINT;");
   blocks = strtoull(arguments[2], NULL, 10);
   frames = strtoull(arguments[3], NULL, 10);
   steps_per_frame = strtoull(arguments[4], NULL, 10);
   per_checkpoint = strtoull(arguments[5], NULL, 10);
   if (frames > MOST_SEGMENTS) fail("too many frames:");
   tables[3].width = 9 * blocks; /* 4.5 vertices each */
   tables[4].width = 3 * blocks;
   tables[5].width = 6 * blocks;
   tables[6].rows = tables[7].rows = 4 * blocks;
   H5Eset_auto2(H5E_DEFAULT, NULL, NULL);
   clock_gettime(CLOCK_MONOTONIC, &a);
   if (!strcmp(arguments[1], "copy")) run_copy(frames);
   else if (!strcmp(arguments[1], "swap")) run_swap(frames);
   else if (!strcmp(arguments[1], "segments")) run_segments(frames);
   else run_one(arguments[1], frames, per_checkpoint);
   clock_gettime(CLOCK_MONOTONIC, &b);
   clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &cpu);
   printf("%.3f %.3f\n", (double)(b.tv_sec - a.tv_sec) + 1e-9 * (double)(b.tv_nsec - a.tv_nsec),
          (double)cpu.tv_sec + 1e-9 * (double)cpu.tv_nsec);
   return 0;
}
