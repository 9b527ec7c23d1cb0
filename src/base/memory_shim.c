/* SPDX-License-Identifier: MIT */
/* Thin POSIX shim: is there memory? Safe in a signal handler. */
#define _DEFAULT_SOURCE
#include <stddef.h>
#include <sys/mman.h>

int rockdda_memory_is_there(size_t bytes);
int rockdda_memory_is_gone(void);

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
