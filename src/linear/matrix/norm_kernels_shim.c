/* SPDX-License-Identifier: MIT */
/* Factors and norms of the diagonal blocks of rockdda_linear_block_norm, four blocks at a time: number k of their
 * packed factors is in factor[4 k] to factor[4 k + 3]. Each block is computed as in rockdda_linear_small_blocks. */
#include <float.h>
#include <stdint.h>
#include "block_lanes.h"

typedef int64_t four_bits __attribute__((vector_size(32)));

/* x_0 to x_3: four numbers of each of four blocks, from p_0 to p_3 on. */
#define GATHER_FOUR(p, offset, x0, x1, x2, x3) \
   do \
   { \
      four c_[4]; \
      _Pragma("GCC unroll 4") for (int q_ = 0; q_ < 4; ++q_) \
         memcpy(&c_[q_], (p)[q_] + (offset), sizeof(four)); \
      const four e0_ = __builtin_shufflevector(c_[0], c_[1], 0, 4, 2, 6); \
      const four e1_ = __builtin_shufflevector(c_[0], c_[1], 1, 5, 3, 7); \
      const four e2_ = __builtin_shufflevector(c_[2], c_[3], 0, 4, 2, 6); \
      const four e3_ = __builtin_shufflevector(c_[2], c_[3], 1, 5, 3, 7); \
      x0 = __builtin_shufflevector(e0_, e2_, 0, 1, 4, 5); \
      x1 = __builtin_shufflevector(e1_, e3_, 0, 1, 4, 5); \
      x2 = __builtin_shufflevector(e0_, e2_, 2, 3, 6, 7); \
      x3 = __builtin_shufflevector(e1_, e3_, 2, 3, 6, 7); \
   } while (0)

/* x_0 and x_1: two numbers of each of four blocks. */
#define GATHER_TWO(p, offset, x0, x1) \
   do \
   { \
      two c_[4]; \
      _Pragma("GCC unroll 4") for (int q_ = 0; q_ < 4; ++q_) \
         memcpy(&c_[q_], (p)[q_] + (offset), sizeof(two)); \
      const four e_ = __builtin_shufflevector(c_[0], c_[2], 0, 1, 2, 3); \
      const four f_ = __builtin_shufflevector(c_[1], c_[3], 0, 1, 2, 3); \
      x0 = __builtin_shufflevector(e_, f_, 0, 4, 2, 6); \
      x1 = __builtin_shufflevector(e_, f_, 1, 5, 3, 7); \
   } while (0)

/* Square root of each lane. */
static inline __attribute__((always_inline)) void take_roots(four *x)
{
   double y[4];
   memcpy(y, x, sizeof y);
   for (int q = 0; q < 4; ++q)
      y[q] = __builtin_sqrt(y[q]);
   memcpy(x, y, sizeof y);
}

/* The reciprocal root of what is left of a diagonal entry; 1 where that is not above the entry's rounding error. */
#define PIVOT(rest, entry, root) \
   do \
   { \
      const four_bits m_ = (rest) > least * (entry); \
      good &= m_; \
      four r_ = (four)((m_ & (four_bits)(rest)) | (~m_ & (four_bits)one)); \
      take_roots(&r_); \
      root = one / r_; \
   } while (0)

/* Cholesky factors of the four blocks that begin at a[0] to a[3]. Returns 0, and no factors, when one of them is not
 * finite and positive definite. */
static inline __attribute__((always_inline)) int factorize(const double *const *a, loose_four *l)
{
   const four one = {1, 1, 1, 1}, least = {4 * DBL_EPSILON, 4 * DBL_EPSILON, 4 * DBL_EPSILON, 4 * DBL_EPSILON};
   const four_bits magnitude = {INT64_MAX, INT64_MAX, INT64_MAX, INT64_MAX};
   const four_bits infinite = {0x7ff0000000000000, 0x7ff0000000000000, 0x7ff0000000000000, 0x7ff0000000000000};
   four a11, a21, a31, a41, a51, a61, a22, a32, a42, a52, a62, a33, a43, a53, a63, a44, a54, a64, a55, a65, a66, unused;
   GATHER_FOUR(a, 0, a11, a21, a31, a41);
   GATHER_TWO(a, 4, a51, a61);
   GATHER_TWO(a, 6, unused, a22);
   GATHER_FOUR(a, 8, a32, a42, a52, a62);
   GATHER_FOUR(a, 14, a33, a43, a53, a63);
   GATHER_FOUR(a, 20, unused, a44, a54, a64);
   GATHER_TWO(a, 28, a55, a65);
   GATHER_TWO(a, 34, unused, a66);
   (void)unused;
   /* sums of magnitudes, which cannot overflow, are not finite when an entry is not */
   four sum = {0, 0, 0, 0};
#define ADD(x) sum += 0.03125 * (four)((four_bits)(x) & magnitude)
   ADD(a11), ADD(a21), ADD(a31), ADD(a41), ADD(a51), ADD(a61), ADD(a22), ADD(a32), ADD(a42), ADD(a52), ADD(a62);
   ADD(a33), ADD(a43), ADD(a53), ADD(a63), ADD(a44), ADD(a54), ADD(a64), ADD(a55), ADD(a65), ADD(a66);
   four_bits good = infinite & ~(four_bits)sum;
   if (good[0] == 0 || good[1] == 0 || good[2] == 0 || good[3] == 0)
      return 0;
   good = (four_bits){-1, -1, -1, -1};
   four p1, p2, p3, p4, p5, p6, rest;
   PIVOT(a11, a11, p1);
   const four c21 = a21 * p1, c31 = a31 * p1, c41 = a41 * p1, c51 = a51 * p1, c61 = a61 * p1;
   rest = a22 - c21 * c21;
   PIVOT(rest, a22, p2);
   const four c32 = (a32 - c31 * c21) * p2, c42 = (a42 - c41 * c21) * p2;
   const four c52 = (a52 - c51 * c21) * p2, c62 = (a62 - c61 * c21) * p2;
   rest = (a33 - c31 * c31) - c32 * c32;
   PIVOT(rest, a33, p3);
   const four c43 = ((a43 - c41 * c31) - c42 * c32) * p3, c53 = ((a53 - c51 * c31) - c52 * c32) * p3;
   const four c63 = ((a63 - c61 * c31) - c62 * c32) * p3;
   rest = ((a44 - c41 * c41) - c42 * c42) - c43 * c43;
   PIVOT(rest, a44, p4);
   const four c54 = (((a54 - c51 * c41) - c52 * c42) - c53 * c43) * p4;
   const four c64 = (((a64 - c61 * c41) - c62 * c42) - c63 * c43) * p4;
   rest = (((a55 - c51 * c51) - c52 * c52) - c53 * c53) - c54 * c54;
   PIVOT(rest, a55, p5);
   const four c65 = ((((a65 - c61 * c51) - c62 * c52) - c63 * c53) - c64 * c54) * p5;
   rest = ((((a66 - c61 * c61) - c62 * c62) - c63 * c63) - c64 * c64) - c65 * c65;
   PIVOT(rest, a66, p6);
   if (good[0] == 0 || good[1] == 0 || good[2] == 0 || good[3] == 0)
      return 0;
   const four packed[21] = {p1,  c21, c31, c41, c51, c61, p2,  c32, c42, c52, c62,
                            p3,  c43, c53, c63, p4,  c54, c64, p5,  c65, p6};
#pragma GCC unroll 21
   for (int k = 0; k < 21; ++k)
      l[k] = packed[k];
   return 1;
}

/* Add the squares r^T A^-1 r of the first n of four blocks with these factors, whose forces begin at p[0] to p[3], one
 * after the other. */
static inline __attribute__((always_inline)) double add_squares(double total, int n, const loose_four *l,
                                                                const double *const *p)
{
   four r1, r2, r3, r4, r5, r6;
   GATHER_FOUR(p, 0, r1, r2, r3, r4);
   GATHER_TWO(p, 4, r5, r6);
   const four b1 = r1 * l[0];
   const four b2 = (r2 - l[1] * b1) * l[6];
   const four b3 = ((r3 - l[2] * b1) - l[7] * b2) * l[11];
   const four b4 = (((r4 - l[3] * b1) - l[8] * b2) - l[12] * b3) * l[15];
   const four b5 = ((((r5 - l[4] * b1) - l[9] * b2) - l[13] * b3) - l[16] * b4) * l[18];
   const four b6 = (((((r6 - l[5] * b1) - l[10] * b2) - l[14] * b3) - l[17] * b4) - l[19] * b5) * l[20];
   const four square = ((((b1 * b1 + b2 * b2) + b3 * b3) + b4 * b4) + b5 * b5) + b6 * b6;
   total += square[0];
   if (n > 1)
      total += square[1];
   if (n > 2)
      total += square[2];
   if (n > 3)
      total += square[3];
   return total;
}

/* The factors of four blocks of `values`, in place[0] to place[3], counted from 1; those in place[4] to place[7] come
 * next. Returns 0, with an undefined factor, when one of them is not finite and positive definite. */
FOR_EACH_PROCESSOR
int rockdda_factorize_four(const double *values, const int *place, double *factor)
{
   const double *a[4];
   for (int q = 0; q < 4; ++q)
   {
      a[q] = values + 36 * ((long)place[q] - 1);
      const double *next = values + 36 * ((long)place[q + 4] - 1);
      SOON_BLOCK(next, 0);
      SOON(next, BLOCK_BYTES - 8);
   }
   return factorize(a, (loose_four *)factor);
}

/* Sum of r^T A^-1 r over n blocks with these factors, block by block. */
FOR_EACH_PROCESSOR
double rockdda_sum_of_squares(int n, const double *factor, const double *r)
{
   double total = 0;
   double padded[24] = {0};
   for (; n > 0; n -= 4, factor += 84, r += 24)
   {
      if (n < 4)
      {
         memcpy(padded, r, 6 * n * sizeof(double));
         r = padded;
      }
      const double *p[4] = {r, r + 6, r + 12, r + 18};
      total = add_squares(total, n, (const loose_four *)factor, p);
   }
   return total;
}

/* Add the same of the n blocks of `values` in place[0] to place[n - 1], with factors that are not kept, to a total.
 * Returns 0 when a block is not finite and positive definite. */
FOR_EACH_PROCESSOR
int rockdda_sum_anew(int n, const double *values, const int *place, const double *r, double *total)
{
   double sum = *total;
   double padded[24] = {0};
   four l[21];
   for (; n > 0; n -= 4, place += 4, r += 24)
   {
      const double *a[4];
      for (int q = 0; q < 4; ++q)
      {
         a[q] = values + 36 * ((long)place[q < n ? q : n - 1] - 1);
         SOON_BLOCK(values + 36 * ((long)place[q + 4 < n ? q + 4 : n - 1] - 1), 0);
      }
      if (!factorize(a, (loose_four *)l))
         return 0;
      if (n < 4)
      {
         memcpy(padded, r, 6 * n * sizeof(double));
         r = padded;
      }
      const double *p[4] = {r, r + 6, r + 12, r + 18};
      sum = add_squares(sum, n, (const loose_four *)l, p);
   }
   *total = sum;
   return 1;
}
