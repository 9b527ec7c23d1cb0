/* SPDX-License-Identifier: MIT */
/* Thin POSIX shim: is there memory? Safe in a signal handler. And pages of memory before their first use. */
#define _DEFAULT_SOURCE
#include <stddef.h>
#include <stdint.h>
#include <string.h>
#include <sys/mman.h>
#include <unistd.h>
#ifdef _OPENMP
#include <omp.h>
#endif

int rockdda_memory_is_there(size_t bytes);
int rockdda_memory_is_gone(void);
void rockdda_memory_take(void *from, size_t bytes, int clears, int is_huge);

/* Where memory counts as used up [bytes]. */
enum { NEXT_TO_NOTHING = 16 << 20 };

/* Could so much memory be mapped? Nothing is kept. */
int rockdda_memory_is_there(size_t bytes)
{
   void *room = mmap(NULL, bytes, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS | MAP_NORESERVE, -1, 0);
   if (room == MAP_FAILED) return 0;
   munmap(room, bytes);
   return 1;
}

/* Is memory as good as used up? */
int rockdda_memory_is_gone(void)
{
   return !rockdda_memory_is_there(NEXT_TO_NOTHING);
}

/* Bytes of a huge page. */
#define HUGE_PAGE ((uintptr_t)2 << 20)

/* Bytes that a thread takes and clears at a time: they stay in the cache in between. */
#define PART ((size_t)4 << 20)

/* Ask for huge pages where they fit whole into a part of memory: so it becomes no larger. Does nothing where the system
 * has none. */
static void widen(char *from, size_t bytes)
{
#ifdef MADV_HUGEPAGE
   uintptr_t first = ((uintptr_t)from + HUGE_PAGE - 1) / HUGE_PAGE * HUGE_PAGE;
   uintptr_t end = ((uintptr_t)from + bytes) / HUGE_PAGE * HUGE_PAGE;
   if (end > first) (void)madvise((void *)first, end - first, MADV_HUGEPAGE);
#else
   (void)from;
   (void)bytes;
#endif
}

/* Take the pages that begin in a part of memory from the system in one call, which else come one by one, each with a
 * fault; but none that ends behind `end`. Does nothing where the system has no such call (Linux before 5.14). */
static void take(char *from, size_t bytes, char *end)
{
#ifdef MADV_POPULATE_WRITE
   uintptr_t page = (uintptr_t)sysconf(_SC_PAGESIZE);
   uintptr_t first = ((uintptr_t)from + page - 1) / page * page;
   uintptr_t last = ((uintptr_t)from + bytes + page - 1) / page * page, limit = (uintptr_t)end / page * page;
   if (last > limit) last = limit;
   if (last > first) (void)madvise((void *)first, last - first, MADV_POPULATE_WRITE);
#else
   (void)from;
   (void)bytes;
   (void)end;
#endif
}

/* Take the pages of memory, and set its bytes to zero if wanted. The system clears new pages, which takes most of the
 * time: all threads share that, unless they are at work already. With huge pages where they fit whole into it if
 * `is_huge`. */
void rockdda_memory_take(void *from, size_t bytes, int clears, int is_huge)
{
   char *start = from, *end = start + bytes;
   long n_parts = (long)((bytes + PART - 1) / PART);
   if (is_huge) widen(start, bytes);
#ifdef _OPENMP
#pragma omp parallel for schedule(static) if (n_parts > 1 && !omp_in_parallel())
#endif
   for (long p = 0; p < n_parts; ++p)
   {
      char *first = start + (size_t)p * PART;
      size_t length = (size_t)(end - first) < PART ? (size_t)(end - first) : PART;
      take(first, length, end);
      if (clears) memset(first, 0, length);
   }
}
