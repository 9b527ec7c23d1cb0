/* SPDX-License-Identifier: MIT */
/* Thin POSIX shim: is there memory? Safe in a signal handler. And pages of memory before their first use. */
#define _DEFAULT_SOURCE
#include <stddef.h>
#include <stdint.h>
#include <sys/mman.h>
#include <unistd.h>

int rockdda_memory_is_there(size_t bytes);
int rockdda_memory_is_gone(void);
void rockdda_memory_take(void *from, size_t bytes);
void rockdda_memory_widen(void *from, size_t bytes);

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

/* Ask for huge pages where they fit whole into a part of memory: so it becomes no larger. Does nothing where the system
 * has none. */
void rockdda_memory_widen(void *from, size_t bytes)
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

/* Take the pages of a part of memory from the system in one call, which else come one by one, each with a fault. Pages
 * that lie across its ends are left. Does nothing where the system has no such call (Linux before 5.14). */
void rockdda_memory_take(void *from, size_t bytes)
{
#ifdef MADV_POPULATE_WRITE
   uintptr_t page = (uintptr_t)sysconf(_SC_PAGESIZE);
   uintptr_t first = ((uintptr_t)from + page - 1) / page * page, end = ((uintptr_t)from + bytes) / page * page;
   if (end > first) (void)madvise((void *)first, end - first, MADV_POPULATE_WRITE);
#else
   (void)from;
   (void)bytes;
#endif
}
