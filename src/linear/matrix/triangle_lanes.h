/* SPDX-License-Identifier: MIT */
/* Lower triangles of 6x6, packed column by column without the zeros above. */
#ifndef ROCKDDA_TRIANGLE_LANES_H
#define ROCKDDA_TRIANGLE_LANES_H

#include "block_lanes.h"

/* Place of row i, column j of a packed lower triangle, both counted from 0. */
#define PACKED(i, j) ((j) * (11 - (j)) / 2 + (i))

/* The columns of a packed lower triangle, with zeros above. Loads begin before a column, and its first lanes are
 * replaced. */
#define UNPACK(s, s4, s2) \
   do \
   { \
      const four zero_ = {0, 0, 0, 0}; \
      LOAD((s4)[0], (s2)[0], s); \
      LOAD((s4)[1], (s2)[1], (s) + PACKED(0, 1)); \
      LOAD((s4)[2], (s2)[2], (s) + PACKED(0, 2)); \
      LOAD((s4)[3], (s2)[3], (s) + PACKED(0, 3)); \
      memcpy(&(s2)[4], (s) + PACKED(4, 4), sizeof(two)); \
      memcpy(&(s2)[5], (s) + PACKED(4, 5), sizeof(two)); \
      (s4)[1] = __builtin_shufflevector((s4)[1], zero_, 4, 1, 2, 3); \
      (s4)[2] = __builtin_shufflevector((s4)[2], zero_, 4, 5, 2, 3); \
      (s4)[3] = __builtin_shufflevector((s4)[3], zero_, 4, 5, 6, 3); \
      (s2)[5] = __builtin_shufflevector((s2)[5], LOW(zero_), 2, 1); \
   } while (0)

/* Rows 1 to 4 of S a, given a column a of six numbers. */
#define SCALE_UPPER(s4, a) (((s4)[0] * (a)[0] + (s4)[1] * (a)[1]) + ((s4)[2] * (a)[2] + (s4)[3] * (a)[3]))

#endif
