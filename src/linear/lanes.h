/* SPDX-License-Identifier: MIT */
/* Vectors of four and of two numbers, for kernels of 6x6 blocks. Processors with AVX take four numbers of double
 * precision at a time, others two: the compiler makes a version for each, of which the loader chooses one. Each entry
 * is computed by the same operations in the same order in all of them, so that the bits do not depend on the
 * processor. */
#ifndef ROCKDDA_LANES_H
#define ROCKDDA_LANES_H
#include <string.h>

#if defined(__x86_64__) && defined(__gnu_linux__) && defined(__GNUC__) && !defined(__clang__)
#define FOR_EACH_PROCESSOR __attribute__((target_clones("avx", "default")))
#else
#define FOR_EACH_PROCESSOR
#endif

typedef double four __attribute__((vector_size(32)));
typedef double two __attribute__((vector_size(16)));
/* Four numbers anywhere in memory. */
typedef double loose_four __attribute__((vector_size(32), aligned(8), may_alias));
typedef float single_four __attribute__((vector_size(16)));

/* Rows 1 to 4 and 5 to 6 of a column. */
#define LOAD(c4, c2, from) (memcpy(&(c4), (from), sizeof(four)), memcpy(&(c2), (from) + 4, sizeof(two)))
#define STORE(c4, c2, to) (memcpy((to), &(c4), sizeof(four)), memcpy((to) + 4, &(c2), sizeof(two)))

#endif
