/* SPDX-License-Identifier: MIT */
/* To be preloaded: no memory from the n-th request on, for the program and all its libraries. REFUSE_AT = n;
 * REFUSE_COUNT = a file that receives the number of requests at the end. */
#define _GNU_SOURCE
#include <errno.h>
#include <fcntl.h>
#include <stdatomic.h>
#include <stdio.h>
#include <stdlib.h>
#include <sys/mman.h>
#include <sys/syscall.h>
#include <unistd.h>

void *__libc_malloc(size_t bytes);
void *__libc_calloc(size_t n, size_t bytes);
void *__libc_realloc(void *old, size_t bytes);

static atomic_long requests = 0;
static atomic_long last = -2; /* requests that are met; -1: all */

/* The loader and the constructors of libraries are before the program. */
__attribute__((constructor)) static void start(void)
{
   const char *at = getenv("REFUSE_AT");
   atomic_store(&requests, 0);
   atomic_store(&last, at ? atol(at) - 1 : -1);
}

__attribute__((destructor)) static void tell(void)
{
   const char *path = getenv("REFUSE_COUNT");
   char text[32];
   int file, n;
   atomic_store(&last, -1);
   if (!path) return;
   file = open(path, O_WRONLY | O_CREAT | O_TRUNC, 0666);
   n = snprintf(text, sizeof text, "%ld\n", atomic_load(&requests));
   if (file < 0 || write(file, text, (size_t)n) != n) return;
   close(file);
}

static int refused(void)
{
   long number = atomic_fetch_add(&requests, 1) + 1, limit = atomic_load(&last);
   if (limit < 0 || number <= limit) return 0;
   errno = ENOMEM;
   return 1;
}

void *malloc(size_t bytes) { return refused() ? NULL : __libc_malloc(bytes); }
void *calloc(size_t n, size_t bytes) { return refused() ? NULL : __libc_calloc(n, bytes); }
void *realloc(void *old, size_t bytes) { return refused() ? NULL : __libc_realloc(old, bytes); }

/* The program looks whether there is memory at all by this. */
void *mmap(void *place, size_t bytes, int protection, int flags, int file, off_t offset)
{
   long limit = atomic_load(&last);
   if ((flags & MAP_ANONYMOUS) && limit >= 0 && atomic_load(&requests) > limit) {
      errno = ENOMEM;
      return MAP_FAILED;
   }
   return (void *)syscall(SYS_mmap, place, bytes, protection, flags, file, offset);
}
