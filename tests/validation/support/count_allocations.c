// SPDX-License-Identifier: MIT
// Counts what the program asks of the heap; linked with -Wl,--wrap=malloc,--wrap=calloc,--wrap=realloc.
#include <stddef.h>

static long long count;

void *__real_malloc(size_t size);
void *__real_calloc(size_t n, size_t size);
void *__real_realloc(void *old, size_t size);

void *__wrap_malloc(size_t size) {
  ++count;
  return __real_malloc(size);
}

void *__wrap_calloc(size_t n, size_t size) {
  ++count;
  return __real_calloc(n, size);
}

void *__wrap_realloc(void *old, size_t size) {
  ++count;
  return __real_realloc(old, size);
}

// Requests so far.
long long count_allocations(void) { return count; }
