/* SPDX-License-Identifier: MIT */
/* Parallel regions of one thread without a team. libgomp makes a team for them too, and each barrier in it is a system
 * call: a run of 100 steps of 112 blocks made 100,000 of them, a tenth of its time. Without a team, barriers return at
 * once and a shared loop is the whole loop. Linked with --wrap=GOMP_parallel where the compiler is GNU's; without it
 * only that time is lost.
 *
 * Inside another region the body would take part in the loops of the team around it: there libgomp does as usual. */
#include <omp.h>

void __real_GOMP_parallel(void (*body)(void *), void *data, unsigned n_threads, unsigned flags);
void __wrap_GOMP_parallel(void (*body)(void *), void *data, unsigned n_threads, unsigned flags);

void __wrap_GOMP_parallel(void (*body)(void *), void *data, unsigned n_threads, unsigned flags)
{
   int wanted = n_threads > 0 ? (int)n_threads : omp_get_max_threads(); /* 0: as many as OpenMP is set to */
   if (wanted == 1 && omp_get_level() == 0)
      body(data);
   else
      __real_GOMP_parallel(body, data, n_threads, flags);
}
