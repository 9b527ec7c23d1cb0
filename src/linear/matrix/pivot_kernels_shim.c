/* SPDX-License-Identifier: MIT */
/* Rows of the preconditioner of rockdda_linear_preconditioner: pivots and scaled couplings. Blocks of 6x6 are stored
 * column by column, lower triangles without the zeros above. */
#include "triangle_lanes.h"

/* b := a S^T with a packed lower triangle S, for rows in lanes. */
#define TIMES_TRANSPOSED(a, s, b) \
   do \
   { \
      (b)[5] = ((a)[0] * (s)[PACKED(5, 0)] + (a)[1] * (s)[PACKED(5, 1)]) + \
               ((a)[2] * (s)[PACKED(5, 2)] + (a)[3] * (s)[PACKED(5, 3)]) + \
               ((a)[4] * (s)[PACKED(5, 4)] + (a)[5] * (s)[PACKED(5, 5)]); \
      (b)[4] = ((a)[0] * (s)[PACKED(4, 0)] + (a)[1] * (s)[PACKED(4, 1)]) + \
               ((a)[2] * (s)[PACKED(4, 2)] + (a)[3] * (s)[PACKED(4, 3)]) + (a)[4] * (s)[PACKED(4, 4)]; \
      (b)[3] = ((a)[0] * (s)[PACKED(3, 0)] + (a)[1] * (s)[PACKED(3, 1)]) + \
               ((a)[2] * (s)[PACKED(3, 2)] + (a)[3] * (s)[PACKED(3, 3)]); \
      (b)[2] = ((a)[0] * (s)[PACKED(2, 0)] + (a)[1] * (s)[PACKED(2, 1)]) + (a)[2] * (s)[PACKED(2, 2)]; \
      (b)[1] = (a)[0] * (s)[PACKED(1, 0)] + (a)[1] * (s)[PACKED(1, 1)]; \
      (b)[0] = (a)[0] * (s)[PACKED(0, 0)]; \
   } while (0)

/* Rows 5 and 6 of S a for two columns, first those of the first one; `twice` has the rows of S twice. */
#define BOTH(a, b, k) ((four){(a)[k], (a)[k], (b)[k], (b)[k]})
#define SCALE_LOWER(twice, a, b) \
   (((twice)[0] * BOTH(a, b, 0) + (twice)[1] * BOTH(a, b, 1)) + \
    ((twice)[2] * BOTH(a, b, 2) + (twice)[3] * BOTH(a, b, 3)) + \
    ((twice)[4] * BOTH(a, b, 4) + (twice)[5] * BOTH(a, b, 5)))

/* Two neighbouring columns u and v in tiles of single precision: t[r] has rows 2 r, 2 r + 1 of the first, then of the
 * second; w has rows 5 and 6 of both. */
#define TILES(u, v, w, t) \
   ((t)[0] = __builtin_convertvector(__builtin_shufflevector(u, v, 0, 1, 4, 5), single_four), \
    (t)[1] = __builtin_convertvector(__builtin_shufflevector(u, v, 2, 3, 6, 7), single_four), \
    (t)[2] = __builtin_convertvector(w, single_four))

/* Fetch the diagonal block of a row and its couplings q from first to last, in place[q] of the matrix (negative:
 * transposed), all counted from 1. */
void rockdda_expect_row(int diagonal, int first, int last, const int *place, const double *values)
{
   SOON_BLOCK(values + 36 * ((long)diagonal - 1), 0);
   for (int q = first - 1; q < last; ++q)
      SOON_BLOCK(values + 36 * ((long)(place[q] > 0 ? place[q] : -place[q]) - 1), 0);
}

/* b := K_q S_j^T for each coupling q from first to last, K_q in place[q] of the matrix (negative: transposed),
 * j = column[q], all counted from 1; with `squares` d := d - b b^T, at least its lower half. */
FOR_EACH_PROCESSOR
void rockdda_eliminate_couplings(int first, int last, const int *place, const int *column, const double *values,
                                 const double *scale, int squares, double *b, double *d)
{
   for (int q = first - 1; q < last; ++q, b += 36)
   {
      const double *s = scale + 21 * ((long)column[q] - 1);
      four a4[6], b4[6], d4;
      two a2[6], b2[6], d2;
      TAKE(values, place[q], a4, a2);
      TIMES_TRANSPOSED(a4, s, b4);
      TIMES_TRANSPOSED(a2, s, b2);
#pragma GCC unroll 6
      for (int j = 0; j < 6; ++j)
         STORE(b4[j], b2[j], b + 6 * j);
      if (!squares)
         continue;
#pragma GCC unroll 6
      for (int j = 0; j < 6; ++j)
      {
         const double *x = b + j;
         LOAD(d4, d2, d + 6 * j);
         if (j < 4)
         {
            d4 -= (b4[0] * x[0] + b4[1] * x[6]) + (b4[2] * x[12] + b4[3] * x[18]) + (b4[4] * x[24] + b4[5] * x[30]);
            memcpy(d + 6 * j, &d4, sizeof(four));
         }
         d2 -= (b2[0] * x[0] + b2[1] * x[6]) + (b2[2] * x[12] + b2[3] * x[18]) + (b2[4] * x[24] + b2[5] * x[30]);
         memcpy(d + 6 * j + 4, &d2, sizeof(two));
      }
   }
}

/* The remainder 2 I - S d S^T in tiles. */
FOR_EACH_PROCESSOR
void rockdda_scale_diagonal(const double *s, const double *d, float *remainder)
{
   static const four two4[4] = {{2, 0, 0, 0}, {0, 2, 0, 0}, {0, 0, 2, 0}, {0, 0, 0, 2}};
   static const two two2[2] = {{2, 0}, {0, 2}};
   four s4[6], twice[6], a4[6], b4[6], low;
   two s2[6], a2[6], b2[6];
   UNPACK(s, s4, s2);
#pragma GCC unroll 6
   for (int j = 0; j < 6; ++j)
      twice[j] = __builtin_shufflevector(s2[j], s2[j], 0, 1, 0, 1);
#pragma GCC unroll 3
   for (int j = 0; j < 6; j += 2)
   {
      a4[j] = SCALE_UPPER(s4, d + 6 * j);
      a4[j + 1] = SCALE_UPPER(s4, d + 6 * j + 6);
      low = SCALE_LOWER(twice, d + 6 * j, d + 6 * j + 6);
      a2[j] = LOW(low);
      a2[j + 1] = HIGH(low);
   }
   TIMES_TRANSPOSED(a4, s, b4);
   TIMES_TRANSPOSED(a2, s, b2);
#pragma GCC unroll 6
   for (int j = 0; j < 6; ++j)
   {
      b4[j] = j < 4 ? two4[j] - b4[j] : -b4[j];
      b2[j] = j < 4 ? -b2[j] : two2[j - 4] - b2[j];
   }
#pragma GCC unroll 3
   for (int c = 0; c < 3; ++c)
   {
      single_four t[3];
      low = __builtin_shufflevector(b2[2 * c], b2[2 * c + 1], 0, 1, 2, 3);
      TILES(b4[2 * c], b4[2 * c + 1], low, t);
#pragma GCC unroll 3
      for (int r = 0; r < 3; ++r)
         memcpy(remainder + 12 * r + 4 * c, &t[r], sizeof(single_four));
   }
}

/* lower_q := S b in tiles for each coupling q from first to last, and upper_k its transpose, k = transposed[q] or 0:
 * none; all are counted from 1. */
FOR_EACH_PROCESSOR
void rockdda_scale_couplings(int first, int last, const double *s, const double *b, const int *transposed, float *lower,
                             float *upper)
{
   four s4[6], twice[6];
   two s2[6];
   UNPACK(s, s4, s2);
#pragma GCC unroll 6
   for (int j = 0; j < 6; ++j)
      twice[j] = __builtin_shufflevector(s2[j], s2[j], 0, 1, 0, 1);
   for (int q = first - 1; q < last; ++q, b += 36)
   {
      float *own = lower + 36 * (long)q;
      float *other = transposed[q] > 0 ? upper + 36 * ((long)transposed[q] - 1) : NULL;
#pragma GCC unroll 3
      for (int c = 0; c < 3; ++c)
      {
         single_four t[3];
         const four u = SCALE_UPPER(s4, b + 12 * c), v = SCALE_UPPER(s4, b + 12 * c + 6);
         const four w = SCALE_LOWER(twice, b + 12 * c, b + 12 * c + 6);
         TILES(u, v, w, t);
#pragma GCC unroll 3
         for (int r = 0; r < 3; ++r)
            memcpy(own + 12 * r + 4 * c, &t[r], sizeof(single_four));
         if (!other)
            continue;
#pragma GCC unroll 3
         for (int r = 0; r < 3; ++r)
         {
            t[r] = __builtin_shufflevector(t[r], t[r], 0, 2, 1, 3);
            memcpy(other + 12 * c + 4 * r, &t[r], sizeof(single_four));
         }
      }
   }
}
