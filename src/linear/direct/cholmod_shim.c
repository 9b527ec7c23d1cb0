/* SPDX-License-Identifier: MIT */
/* CHOLMOD behind a handle: analyse once, factorise and solve often. Index arrays are borrowed for each call
 * (64-bit, 0-based, compressed columns of the lower triangle); no call prints. Used by cholmod.f90 only. */
#define _GNU_SOURCE
#include <dlfcn.h>
#include <pthread.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>
#include <cholmod.h>

typedef struct {
   cholmod_common common;
   cholmod_factor *factor;
   cholmod_dense *x, *y, *e;   /* workspace of cholmod_l_solve2 */
   void (*set_threads)(int);   /* OpenBLAS, when that is the BLAS in use */
   int (*get_threads)(void);
   void (*set_levels)(int);    /* OpenMP, when CHOLMOD brings it along */
   int (*get_levels)(void);
} solver_t;

/* BLAS threads would change the order of sums: one thread while we are inside. The setting is one for the whole
 * process, where several threads may be inside at a time: the first in takes it, the last out gives it back. */
static pthread_mutex_t gate = PTHREAD_MUTEX_INITIALIZER;
static int inside = 0, blas_before = 1;

/* Settings to go back to after a call. */
typedef struct {
   int levels;   /* of the calling thread */
} threads_t;

/* One thread inside CHOLMOD: sums in one order, and no team of four woken for a few small supernodes (CHOLMOD requests
 * a fixed number of OpenMP threads for any number of the program's own). */
static threads_t one_thread(const solver_t *s)
{
   threads_t before = {-1};
   if (s->set_threads && s->get_threads) {
      pthread_mutex_lock(&gate);
      if (inside++ == 0) {
         blas_before = s->get_threads();
         if (blas_before != 1) s->set_threads(1);
      }
      pthread_mutex_unlock(&gate);
   }
   if (s->set_levels && s->get_levels) {
      before.levels = s->get_levels();
      s->set_levels(0);
   }
   return before;
}

static void restore_threads(const solver_t *s, threads_t before)
{
   if (s->set_threads && s->get_threads) {
      pthread_mutex_lock(&gate);
      if (--inside == 0 && blas_before != 1) s->set_threads(blas_before);
      pthread_mutex_unlock(&gate);
   }
   if (before.levels >= 0) s->set_levels(before.levels);
}

static cholmod_sparse lower_matrix(int64_t n, const int64_t *p, const int64_t *i, const double *x)
{
   cholmod_sparse a;
   memset(&a, 0, sizeof a);
   a.nrow = a.ncol = (size_t)n;
   a.nzmax = (size_t)p[n];
   a.p = (void *)p;
   a.i = (void *)i;
   a.x = (void *)x;
   a.stype = -1;
   a.itype = CHOLMOD_LONG;
   a.xtype = x ? CHOLMOD_REAL : CHOLMOD_PATTERN;
   a.dtype = CHOLMOD_DOUBLE;
   a.sorted = 1;
   a.packed = 1;
   return a;
}

void *rockdda_cholmod_new(void)
{
   solver_t *s = calloc(1, sizeof *s);
   if (!s) return NULL;
   if (!cholmod_l_start(&s->common)) {
      free(s);
      return NULL;
   }
   s->common.print = 0;
   s->common.error_handler = NULL;
   s->common.final_ll = 1;                    /* LL' in the simplicial case too: a pivot <= 0 is found */
   s->common.quick_return_if_not_posdef = 1;
   s->set_threads = (void (*)(int))dlsym(RTLD_DEFAULT, "openblas_set_num_threads");
   s->get_threads = (int (*)(void))dlsym(RTLD_DEFAULT, "openblas_get_num_threads");
   s->set_levels = (void (*)(int))dlsym(RTLD_DEFAULT, "omp_set_max_active_levels");
   s->get_levels = (int (*)(void))dlsym(RTLD_DEFAULT, "omp_get_max_active_levels");
   return s;
}

void rockdda_cholmod_free(void *handle)
{
   solver_t *s = handle;
   if (!s) return;
   cholmod_l_free_factor(&s->factor, &s->common);
   cholmod_l_free_dense(&s->x, &s->common);
   cholmod_l_free_dense(&s->y, &s->common);
   cholmod_l_free_dense(&s->e, &s->common);
   cholmod_l_finish(&s->common);
   free(s);
}

/* Fill-reducing order of the graph of nb blocks (pattern bp, bi), each expanded to m unknowns, then the symbolic
 * factorisation of the matrix of m*nb unknowns (pattern p, i). Returns CHOLMOD's status. */
int rockdda_cholmod_analyze(void *handle, int64_t nb, const int64_t *bp, const int64_t *bi, int64_t m,
                            const int64_t *p, const int64_t *i, double *fill, double *flops)
{
   solver_t *s = handle;
   cholmod_common *c = &s->common;
   cholmod_sparse blocks = lower_matrix(nb, bp, bi, NULL), a = lower_matrix(m*nb, p, i, NULL);
   cholmod_factor *order;
   SuiteSparse_long *perm;
   int64_t k, r;

   cholmod_l_free_factor(&s->factor, c);
   /* minimum degree; for large models nested dissection too, and the better of both */
   c->nmethods = nb < 5000 ? 1 : 2;
   c->method[0].ordering = CHOLMOD_AMD;
   c->method[1].ordering = CHOLMOD_METIS;
   c->supernodal = CHOLMOD_SIMPLICIAL;
   order = cholmod_l_analyze(&blocks, c);
   if (!order) return c->status;
   perm = malloc((size_t)(m*nb)*sizeof *perm);
   if (!perm) {
      cholmod_l_free_factor(&order, c);
      return CHOLMOD_OUT_OF_MEMORY;
   }
   for (k = 0; k < nb; k++)
      for (r = 0; r < m; r++) perm[m*k + r] = m*((SuiteSparse_long *)order->Perm)[k] + r;
   cholmod_l_free_factor(&order, c);

   c->nmethods = 1;
   c->method[0].ordering = CHOLMOD_GIVEN;
   c->supernodal = CHOLMOD_AUTO;
   s->factor = cholmod_l_analyze_p(&a, perm, NULL, 0, c);
   free(perm);
   if (s->factor) {
      *fill = c->lnz;
      *flops = c->fl;
   }
   return s->factor ? CHOLMOD_OK : c->status;
}

/* The unknown with the first pivot that is not above `least` times its diagonal entry (0-based, in the order of the
 * matrix), or -1. The diagonal entry comes first in each column of the lower triangle. */
static int64_t small_pivot(const cholmod_factor *f, const int64_t *p, const double *x, double least)
{
   const SuiteSparse_long *perm = f->Perm, *super = f->super, *pi = f->pi, *px = f->px, *fp = f->p;
   const double *fx = f->x;
   int64_t s, c;
   if (!f->is_super) {
      for (c = 0; c < (int64_t)f->n; c++)
         if (!(fx[fp[c]]*fx[fp[c]] > least*x[p[perm[c]]])) return perm[c];
      return -1;
   }
   for (s = 0; s < (int64_t)f->nsuper; s++) {
      int64_t rows = pi[s + 1] - pi[s];
      for (c = super[s]; c < super[s + 1]; c++) {
         double pivot = fx[px[s] + (c - super[s])*(rows + 1)];
         if (!(pivot*pivot > least*x[p[perm[c]]])) return perm[c];
      }
   }
   return -1;
}

/* Numerical factorisation. When the matrix is not positive definite, status CHOLMOD_NOT_POSDEF and the 0-based
 * number of the unknown whose pivot failed; so too for a pivot not above `least` times its diagonal entry. */
int rockdda_cholmod_factorize(void *handle, int64_t n, const int64_t *p, const int64_t *i, const double *x,
                              double least, int64_t *failed)
{
   solver_t *s = handle;
   cholmod_sparse a = lower_matrix(n, p, i, x);
   threads_t threads = one_thread(s);
   int ok;
   *failed = -1;
   ok = cholmod_l_factorize(&a, s->factor, &s->common);
   restore_threads(s, threads);
   if (!ok) return s->common.status;
   if (s->factor->minor < (size_t)n) {
      *failed = ((SuiteSparse_long *)s->factor->Perm)[s->factor->minor];
      return CHOLMOD_NOT_POSDEF;
   }
   *failed = small_pivot(s->factor, p, x, least);
   return *failed < 0 ? CHOLMOD_OK : CHOLMOD_NOT_POSDEF;
}

/* x = A^-1 b. */
int rockdda_cholmod_solve(void *handle, int64_t n, const double *b, double *x)
{
   solver_t *s = handle;
   cholmod_dense rhs;
   threads_t threads = one_thread(s);
   int ok;
   memset(&rhs, 0, sizeof rhs);
   rhs.nrow = rhs.d = rhs.nzmax = (size_t)n;
   rhs.ncol = 1;
   rhs.x = (void *)b;
   rhs.xtype = CHOLMOD_REAL;
   rhs.dtype = CHOLMOD_DOUBLE;
   ok = cholmod_l_solve2(CHOLMOD_A, s->factor, &rhs, NULL, &s->x, NULL, &s->y, &s->e, &s->common);
   restore_threads(s, threads);
   if (!ok) return s->common.status ? s->common.status : CHOLMOD_INVALID;
   memcpy(x, s->x->x, (size_t)n*sizeof *x);
   return CHOLMOD_OK;
}
