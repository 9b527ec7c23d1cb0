/* SPDX-License-Identifier: MIT */
/* End the program with a message when an allocation fails: Fortran would end it as for a bug. Linked with
 * --wrap=malloc,--wrap=calloc,--wrap=realloc, so that it covers allocations of this program; libraries (HDF5, CHOLMOD)
 * report failed allocations themselves. */
#include <stddef.h>
#include <stdint.h>

void rockdda_process_out_of_memory(size_t bytes);

void *__real_malloc(size_t bytes);
void *__real_calloc(size_t n, size_t bytes);
void *__real_realloc(void *old, size_t bytes);
void *__wrap_malloc(size_t bytes);
void *__wrap_calloc(size_t n, size_t bytes);
void *__wrap_realloc(void *old, size_t bytes);

void *__wrap_malloc(size_t bytes)
{
   void *memory = __real_malloc(bytes);
   if (memory == NULL && bytes > 0) rockdda_process_out_of_memory(bytes);
   return memory;
}

void *__wrap_calloc(size_t n, size_t bytes)
{
   void *memory = __real_calloc(n, bytes);
   if (memory == NULL && n > 0 && bytes > 0) rockdda_process_out_of_memory(n > SIZE_MAX / bytes ? SIZE_MAX : n * bytes);
   return memory;
}

void *__wrap_realloc(void *old, size_t bytes)
{
   void *memory = __real_realloc(old, bytes);
   if (memory == NULL && bytes > 0) rockdda_process_out_of_memory(bytes);
   return memory;
}
