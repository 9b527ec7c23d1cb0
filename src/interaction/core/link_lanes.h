/* SPDX-License-Identifier: MIT */
/* Vectors for kernels of links and contacts: two points, or two directions, in one vector of four numbers. */
#ifndef ROCKDDA_LINK_LANES_H
#define ROCKDDA_LINK_LANES_H
#include <string.h>

#include "../../base/lanes.h"

typedef long long mask __attribute__((vector_size(32)));

#ifdef __clang__
#define PICK(v, w, i, j, k, l) __builtin_shufflevector(v, w, i, j, k, l)
#else
#define PICK(v, w, i, j, k, l) __builtin_shuffle(v, w, (mask){i, j, k, l})
#endif

#define LOAD(v, from) memcpy(&(v), (from), sizeof(four))
#define STORE(v, to) memcpy((to), &(v), sizeof(four))

/* Two numbers from each of two places, and to two places. */
#define JOIN(a, b) ((four){(a)[0], (a)[1], (b)[0], (b)[1]})
#define PART(v, a, b)                                                                                                  \
   (memcpy((a), &(v), sizeof(four) / 2), memcpy((b), (char *)&(v) + sizeof(four) / 2, sizeof(four) / 2))

/* A number twice, and another one twice. */
#define TWICE(a, b) ((four){(a), (a), (b), (b)})

/* Of both halves the first number, the second number, and both exchanged. */
#define FIRST(v) PICK(v, v, 0, 0, 2, 2)
#define SECOND(v) PICK(v, v, 1, 1, 3, 3)
#define TURN(v) PICK(v, v, 1, 0, 3, 2)
/* One half twice, both halves exchanged, and halves of two. */
#define LOW(v) PICK(v, v, 0, 1, 0, 1)
#define HIGH(v) PICK(v, v, 2, 3, 2, 3)
#define SWAP(v) PICK(v, v, 2, 3, 0, 1)
#define LOW_AND_HIGH(v, w) PICK(v, w, 0, 1, 6, 7)

#define SIGN (-0x7fffffffffffffffLL - 1)
#define FLIP(v, signs) ((four)((mask)(v) ^ (signs)))
/* Both halves turned by 90 degrees: (-v2, v1). */
#define NORMAL_TO(v) FLIP(TURN(v), ((mask){SIGN, 0, SIGN, 0}))

#endif
