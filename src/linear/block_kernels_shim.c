/* SPDX-License-Identifier: MIT */
/* Products of 6x6 blocks, column by column, for a Cholesky factor by blocks. */
#include "block_lanes.h"

/* C_t := C_t - A_q B^T for n blocks A_1, A_2, … that follow one another, t = target[q], counted from 1. */
FOR_EACH_PROCESSOR
void rockdda_subtract_products(int n, const int *target, const double *a, const double *b, double *c)
{
   for (int q = 0; q < n; ++q, a += 36)
   {
      double *out = c + 36 * (long)(target[q] - 1);
      four a4[6], s4;
      two a2[6], s2;
#pragma GCC unroll 6
      for (int m = 0; m < 6; ++m)
         LOAD(a4[m], a2[m], a + 6 * m);
#pragma GCC unroll 6
      for (int j = 0; j < 6; ++j)
      {
         LOAD(s4, s2, out + 6 * j);
#pragma GCC unroll 6
         for (int m = 0; m < 6; ++m)
         {
            const double x = b[6 * m + j];
            s4 -= a4[m] * x;
            s2 -= a2[m] * x;
         }
         STORE(s4, s2, out + 6 * j);
      }
   }
}

/* C := C - A A^T, at least its lower half. */
FOR_EACH_PROCESSOR
void rockdda_subtract_square(const double *a, double *c)
{
#pragma GCC unroll 6
   for (int j = 0; j < 6; ++j)
   {
      /* rows 1, 3 or 5 to 6 */
      const int first = j & ~1;
      four s4, a4;
      two s2, a2;
      double *out = c + 6 * j;
      if (first < 4)
         memcpy(&s4, out + first, sizeof(four));
      if (first != 2)
         memcpy(&s2, out + 4, sizeof(two));
#pragma GCC unroll 6
      for (int m = 0; m < 6; ++m)
      {
         const double x = a[6 * m + j];
         if (first < 4)
         {
            memcpy(&a4, a + 6 * m + first, sizeof(four));
            s4 -= a4 * x;
         }
         if (first != 2)
         {
            memcpy(&a2, a + 6 * m + 4, sizeof(two));
            s2 -= a2 * x;
         }
      }
      if (first < 4)
         memcpy(out + first, &s4, sizeof(four));
      if (first != 2)
         memcpy(out + 4, &s2, sizeof(two));
   }
}

/* y_i := y_i - A_q x for n blocks that follow one another, i = row[q], counted from 1. */
FOR_EACH_PROCESSOR
void rockdda_subtract_column(int n, const int *row, const double *a, const double *x, double *y)
{
   for (int q = 0; q < n; ++q, a += 36)
   {
      double *out = y + 6 * (long)(row[q] - 1);
      four c4, s4;
      two c2, s2;
      LOAD(s4, s2, out);
      for (int m = 0; m < 6; ++m)
      {
         LOAD(c4, c2, a + 6 * m);
         s4 -= c4 * x[m];
         s2 -= c2 * x[m];
      }
      STORE(s4, s2, out);
   }
}

/* x := x - sum over n blocks that follow one another of A_q^T y_i, i = row[q], counted from 1. */
FOR_EACH_PROCESSOR
void rockdda_subtract_row(int n, const int *row, const double *a, const double *y, double *x)
{
   four s4[6], a4, y4;
   two s2[6], a2, y2;
   for (int j = 0; j < 6; ++j)
   {
      s4[j] = (four){0, 0, 0, 0};
      s2[j] = (two){0, 0};
   }
   for (int q = 0; q < n; ++q, a += 36)
   {
      LOAD(y4, y2, y + 6 * (long)(row[q] - 1));
      for (int j = 0; j < 6; ++j)
      {
         LOAD(a4, a2, a + 6 * j);
         s4[j] += a4 * y4;
         s2[j] += a2 * y2;
      }
   }
   for (int j = 0; j < 6; ++j)
      x[j] -= ((s4[j][0] + s4[j][2]) + (s4[j][1] + s4[j][3])) + (s2[j][0] + s2[j][1]);
}
