/* SPDX-License-Identifier: MIT */
/* BLAS, LAPACK and METIS for a program that CHOLMOD is linked into statically: the libraries are loaded at the first
 * call. Most runs need none of them, and to load OpenBLAS (37 MB, one thread per core) takes longer than a step of a
 * small model.
 *
 * The procedures are those that CHOLMOD and rockdda_linear_dense call. A Fortran procedure receives the length of each
 * text behind all other arguments; every text here has one character. */
#include <dlfcn.h>
#include <pthread.h>
#include <stddef.h>
#include <stdlib.h>

/* Ends the program: a library cannot be loaded. */
void rockdda_process_missing_library(const char *name, const char *reason);

static pthread_mutex_t gate = PTHREAD_MUTEX_INITIALIZER;

static void *load(void **library, const char *name, const char *path)
{
   if (!*library) *library = dlopen(name, RTLD_NOW | RTLD_LOCAL);
   if (!*library) *library = dlopen(path, RTLD_NOW | RTLD_LOCAL);
   return *library;
}

/* A procedure of BLAS or LAPACK. One thread of BLAS: sums in one order, and no idle threads. */
static void *find_blas(const char *name)
{
   static void *library = NULL;
   void (*set_threads)(int);
   void *found = NULL;
   pthread_mutex_lock(&gate);
   if (!library) {
      setenv("OPENBLAS_NUM_THREADS", "1", 1);
      if (load(&library, ROCKDDA_BLAS, ROCKDDA_BLAS_PATH)) {
         *(void **)&set_threads = dlsym(library, "openblas_set_num_threads");
         if (set_threads) set_threads(1);
      }
   }
   if (library) found = dlsym(library, name);
   if (!found) rockdda_process_missing_library(ROCKDDA_BLAS, dlerror());
   pthread_mutex_unlock(&gate);
   return found;
}

#define CHAR const char *
#define INT const int *
#define STRIP(...) __VA_ARGS__
/* A procedure `name`, loaded at its first call: its parameters and arguments, then types and values of the lengths.
 * CHOLMOD, in C, passes no lengths; therefore the procedure here has none. */
#define BLAS(name, parameters, arguments, types, lengths) \
   void name parameters; \
   void name parameters \
   { \
      static void *place = NULL; \
      void (*real)(STRIP parameters STRIP types); \
      void *found = __atomic_load_n(&place, __ATOMIC_ACQUIRE); \
      if (!found) { \
         found = find_blas(#name); \
         __atomic_store_n(&place, found, __ATOMIC_RELEASE); \
      } \
      *(void **)&real = found; \
      real(STRIP arguments STRIP lengths); \
   }

#define GEMM(name) \
   BLAS(name, (CHAR ta, CHAR tb, INT m, INT n, INT k, void *alpha, void *a, INT lda, void *b, INT ldb, void *beta, \
               void *c, INT ldc), \
        (ta, tb, m, n, k, alpha, a, lda, b, ldb, beta, c, ldc), (, size_t, size_t), (, 1, 1))
#define GEMV(name) \
   BLAS(name, (CHAR t, INT m, INT n, void *alpha, void *a, INT lda, void *x, INT incx, void *beta, void *y, INT incy), \
        (t, m, n, alpha, a, lda, x, incx, beta, y, incy), (, size_t), (, 1))
#define POTRF(name) \
   BLAS(name, (CHAR u, INT n, void *a, INT lda, int *info), (u, n, a, lda, info), (, size_t), (, 1))
#define SYRK(name) \
   BLAS(name, (CHAR u, CHAR t, INT n, INT k, void *alpha, void *a, INT lda, void *beta, void *c, INT ldc), \
        (u, t, n, k, alpha, a, lda, beta, c, ldc), (, size_t, size_t), (, 1, 1))
#define TRSM(name) \
   BLAS(name, (CHAR s, CHAR u, CHAR t, CHAR d, INT m, INT n, void *alpha, void *a, INT lda, void *b, INT ldb), \
        (s, u, t, d, m, n, alpha, a, lda, b, ldb), (, size_t, size_t, size_t, size_t), (, 1, 1, 1, 1))
#define TRSV(name) \
   BLAS(name, (CHAR u, CHAR t, CHAR d, INT n, void *a, INT lda, void *x, INT incx), (u, t, d, n, a, lda, x, incx), \
        (, size_t, size_t, size_t), (, 1, 1, 1))

BLAS(dpotrs_, (CHAR u, INT n, INT nrhs, void *a, INT lda, void *b, INT ldb, int *info),
     (u, n, nrhs, a, lda, b, ldb, info), (, size_t), (, 1))
POTRF(dpotrf_)
GEMM(dgemm_)
GEMV(dgemv_)
SYRK(dsyrk_)
TRSM(dtrsm_)
TRSV(dtrsv_)
POTRF(zpotrf_)
GEMM(zgemm_)
GEMV(zgemv_)
SYRK(zherk_)
TRSM(ztrsm_)
TRSV(ztrsv_)

#ifdef ROCKDDA_METIS
/* A procedure of METIS with seven addresses; without METIS its error code: CHOLMOD then takes another ordering. */
static int call_metis(const char *name, void **a)
{
   static void *library = NULL;
   int (*real)(void *, void *, void *, void *, void *, void *, void *);
   pthread_mutex_lock(&gate);
   load(&library, ROCKDDA_METIS, ROCKDDA_METIS_PATH);
   *(void **)&real = library ? dlsym(library, name) : NULL;
   pthread_mutex_unlock(&gate);
   return real ? real(a[0], a[1], a[2], a[3], a[4], a[5], a[6]) : -4;
}

int METIS_NodeND(void *n, void *start, void *next, void *weight, void *options, void *order, void *inverse);
int METIS_NodeND(void *n, void *start, void *next, void *weight, void *options, void *order, void *inverse)
{
   void *a[7] = {n, start, next, weight, options, order, inverse};
   return call_metis("METIS_NodeND", a);
}

int METIS_ComputeVertexSeparator(void *n, void *start, void *next, void *weight, void *options, void *size, void *part);
int METIS_ComputeVertexSeparator(void *n, void *start, void *next, void *weight, void *options, void *size, void *part)
{
   void *a[7] = {n, start, next, weight, options, size, part};
   return call_metis("METIS_ComputeVertexSeparator", a);
}
#endif
