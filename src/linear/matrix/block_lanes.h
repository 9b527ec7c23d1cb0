/* SPDX-License-Identifier: MIT */
/* Vectors for kernels of 6x6 blocks: of four and of two numbers; blocks of a matrix. */
#ifndef ROCKDDA_BLOCK_LANES_H
#define ROCKDDA_BLOCK_LANES_H
#include <string.h>

#include "../../base/lanes.h"

typedef double two __attribute__((vector_size(16)));
/* Four numbers anywhere in memory. */
typedef double loose_four __attribute__((vector_size(32), aligned(8), may_alias));
typedef float single_four __attribute__((vector_size(16)));

/* Bytes of a block of the matrix; fetch one. */
#define BLOCK_BYTES ((long)(36 * sizeof(double)))
#define SOON_BLOCK(p, bytes) \
   (SOON(p, bytes), SOON(p, (bytes) + 64), SOON(p, (bytes) + 128), SOON(p, (bytes) + 192), SOON(p, (bytes) + 256))

/* Rows 1 to 4 and 5 to 6 of a column. */
#define LOAD(c4, c2, from) (memcpy(&(c4), (from), sizeof(four)), memcpy(&(c2), (from) + 4, sizeof(two)))
#define STORE(c4, c2, to) (memcpy((to), &(c4), sizeof(four)), memcpy((to) + 4, &(c2), sizeof(two)))

/* Lanes of the halves of a column. */
#define LOW(c4) __builtin_shufflevector(c4, c4, 0, 1)
#define HIGH(c4) __builtin_shufflevector(c4, c4, 2, 3)

/* Columns of a block of the matrix, or of its transpose when `place` is negative. */
#define TAKE(values, place, a4, a2) \
   do \
   { \
      if ((place) > 0) \
      { \
         const double *from_ = (values) + 36 * ((long)(place) - 1); \
         _Pragma("GCC unroll 6") for (int j_ = 0; j_ < 6; ++j_) LOAD((a4)[j_], (a2)[j_], from_ + 6 * j_); \
      } \
      else \
      { \
         const double *from_ = (values) + 36 * (-(long)(place) - 1); \
         four c_[6]; \
         two d_[6]; \
         _Pragma("GCC unroll 6") for (int j_ = 0; j_ < 6; ++j_) LOAD(c_[j_], d_[j_], from_ + 6 * j_); \
         const four e0_ = __builtin_shufflevector(c_[0], c_[1], 0, 4, 2, 6); \
         const four e1_ = __builtin_shufflevector(c_[0], c_[1], 1, 5, 3, 7); \
         const four e2_ = __builtin_shufflevector(c_[2], c_[3], 0, 4, 2, 6); \
         const four e3_ = __builtin_shufflevector(c_[2], c_[3], 1, 5, 3, 7); \
         (a4)[0] = __builtin_shufflevector(e0_, e2_, 0, 1, 4, 5); \
         (a4)[1] = __builtin_shufflevector(e1_, e3_, 0, 1, 4, 5); \
         (a4)[2] = __builtin_shufflevector(e0_, e2_, 2, 3, 6, 7); \
         (a4)[3] = __builtin_shufflevector(e1_, e3_, 2, 3, 6, 7); \
         const two p_ = __builtin_shufflevector(d_[0], d_[1], 0, 2), q_ = __builtin_shufflevector(d_[2], d_[3], 0, 2); \
         const two r_ = __builtin_shufflevector(d_[0], d_[1], 1, 3), s_ = __builtin_shufflevector(d_[2], d_[3], 1, 3); \
         (a4)[4] = __builtin_shufflevector(p_, q_, 0, 1, 2, 3); \
         (a4)[5] = __builtin_shufflevector(r_, s_, 0, 1, 2, 3); \
         const four f_ = __builtin_shufflevector(c_[4], c_[5], 0, 4, 2, 6); \
         const four g_ = __builtin_shufflevector(c_[4], c_[5], 1, 5, 3, 7); \
         (a2)[0] = LOW(f_); \
         (a2)[1] = LOW(g_); \
         (a2)[2] = HIGH(f_); \
         (a2)[3] = HIGH(g_); \
         (a2)[4] = __builtin_shufflevector(d_[4], d_[5], 0, 2); \
         (a2)[5] = __builtin_shufflevector(d_[4], d_[5], 1, 3); \
      } \
   } while (0)

/* Sums of the lanes of two vectors. */
#define SUM_LANES(s, t) (__builtin_shufflevector(s, t, 0, 2) + __builtin_shufflevector(s, t, 1, 3))

#endif
