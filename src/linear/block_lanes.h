/* SPDX-License-Identifier: MIT */
/* Vectors for kernels of 6x6 blocks: of four and of two numbers. */
#ifndef ROCKDDA_BLOCK_LANES_H
#define ROCKDDA_BLOCK_LANES_H
#include <string.h>

#include "../base/lanes.h"

typedef double two __attribute__((vector_size(16)));
/* Four numbers anywhere in memory. */
typedef double loose_four __attribute__((vector_size(32), aligned(8), may_alias));
typedef float single_four __attribute__((vector_size(16)));

/* Rows 1 to 4 and 5 to 6 of a column. */
#define LOAD(c4, c2, from) (memcpy(&(c4), (from), sizeof(four)), memcpy(&(c2), (from) + 4, sizeof(two)))
#define STORE(c4, c2, to) (memcpy((to), &(c4), sizeof(four)), memcpy((to) + 4, &(c2), sizeof(two)))

#endif
