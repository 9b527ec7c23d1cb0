/* SPDX-License-Identifier: MIT */
/* To be preloaded: a function of HDF5 or CHOLMOD that fails. FAULT_FUNCTION = its name; FAULT_AT = n: the n-th call of
 * it in a process fails, for CHOLMOD all later ones, too; FAULT_STATUS = what CHOLMOD then gives as status, -1: HDF5
 * crashes, in the first process alone and not in its children. FAULT_COUNT = a file that receives the number of calls
 * at the end. */
#define _GNU_SOURCE
#include <dlfcn.h>
#include <signal.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

static long calls = 0;
static pid_t first_process = 0;

__attribute__((constructor)) static void start(void)
{
   first_process = getpid();
}

__attribute__((destructor)) static void tell(void)
{
   const char *path = getenv("FAULT_COUNT");
   FILE *file = path ? fopen(path, "w") : NULL;
   if (!file) return;
   fprintf(file, "%ld\n", calls);
   fclose(file);
}

/* Has this call of the function to fail? */
static int fails(const char *name, int later_too)
{
   const char *chosen = getenv("FAULT_FUNCTION"), *at = getenv("FAULT_AT");
   if (!chosen || !at || strcmp(chosen, name) != 0) return 0;
   const char *status = getenv("FAULT_STATUS");
   if (status && atoi(status) == -1) {
      if (getpid() == first_process && ++calls == atol(at)) raise(SIGSEGV);
      return 0;
   }
   calls++;
   return calls == atol(at) || (later_too && calls > atol(at));
}

/* A function of HDF5: identifiers are 64 bits wide, a negative answer is a failure. */
#define HDF5(result, name, parameters, arguments) \
   result name parameters; \
   result name parameters \
   { \
      result(*real) parameters; \
      if (fails(#name, 0)) return -1; \
      *(void **)&real = dlsym(RTLD_NEXT, #name); \
      return real arguments; \
   }

typedef int64_t id;
HDF5(id, H5Fopen, (const char *path, unsigned flags, id access), (path, flags, access))
HDF5(id, H5Fcreate, (const char *path, unsigned flags, id creation, id access), (path, flags, creation, access))
HDF5(int, H5Fflush, (id object, int scope), (object, scope))
HDF5(id, H5Dopen2, (id place, const char *name, id access), (place, name, access))
HDF5(id, H5Dcreate2, (id place, const char *name, id type, id space, id link, id creation, id access),
     (place, name, type, space, link, creation, access))
HDF5(int, H5Dset_extent, (id dataset, const void *size), (dataset, size))
HDF5(int, H5Dwrite, (id dataset, id type, id memory, id space, id transfer, const void *values),
     (dataset, type, memory, space, transfer, values))
HDF5(int, H5Dwrite_chunk, (id dataset, id transfer, uint32_t filters, const void *place, size_t n, const void *values),
     (dataset, transfer, filters, place, n, values))
HDF5(int, H5Dread, (id dataset, id type, id memory, id space, id transfer, void *values),
     (dataset, type, memory, space, transfer, values))
HDF5(id, H5Acreate2, (id object, const char *name, id type, id space, id creation, id access),
     (object, name, type, space, creation, access))
HDF5(int, H5Awrite, (id attribute, id type, const void *values), (attribute, type, values))
HDF5(int, H5Aread, (id attribute, id type, void *values), (attribute, type, values))
HDF5(int, H5Aiterate2, (id object, int index, int order, void *place, void *visit, void *context),
     (object, index, order, place, visit, context))

#if __has_include(<suitesparse/cholmod.h>)
#include <suitesparse/cholmod.h>
#define WITH_CHOLMOD
#elif __has_include(<cholmod.h>)
#include <cholmod.h>
#define WITH_CHOLMOD
#endif
#ifdef WITH_CHOLMOD

/* A function of CHOLMOD: 0 or NULL and a status are a failure. */
#define CHOLMOD(result, name, parameters, arguments) \
   result name parameters \
   { \
      result(*real) parameters; \
      if (fails(#name, 1)) { \
         const char *status = getenv("FAULT_STATUS"); \
         common->status = status ? atoi(status) : CHOLMOD_OUT_OF_MEMORY; \
         return 0; \
      } \
      *(void **)&real = dlsym(RTLD_NEXT, #name); \
      return real arguments; \
   }

CHOLMOD(int, cholmod_l_start, (cholmod_common * common), (common))
CHOLMOD(cholmod_factor *, cholmod_l_analyze, (cholmod_sparse * a, cholmod_common *common), (a, common))
CHOLMOD(cholmod_factor *, cholmod_l_analyze_p,
        (cholmod_sparse * a, SuiteSparse_long *order, SuiteSparse_long *set, size_t n, cholmod_common *common),
        (a, order, set, n, common))
CHOLMOD(int, cholmod_l_factorize, (cholmod_sparse * a, cholmod_factor *factor, cholmod_common *common),
        (a, factor, common))
CHOLMOD(int, cholmod_l_solve2,
        (int system, cholmod_factor *factor, cholmod_dense *b, cholmod_sparse *bset, cholmod_dense **x,
         cholmod_sparse **xset, cholmod_dense **y, cholmod_dense **e, cholmod_common *common),
        (system, factor, b, bset, x, xset, y, e, common))
#endif
