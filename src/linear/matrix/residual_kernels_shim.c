/* SPDX-License-Identifier: MIT */
/* Residuals r = f - K x of the rows of one chunk, see rockdda_linear_residual. Rows and places are counted from 1. */
#include "block_lanes.h"

/* Blocks of the matrix, and rows, after which what comes is asked for. */
enum { ahead = 8, rows_ahead = 4 };

/* t[j], whose two lanes add up to number j of A^T w. */
#define TRANSPOSED_LANES(a4, a2, w4, w2) \
   ((__builtin_shufflevector((a4) * (w4), (a4) * (w4), 0, 1) + \
     __builtin_shufflevector((a4) * (w4), (a4) * (w4), 2, 3)) + \
    (a2) * (w2))
/* r := f less what the rows first to last of the upper half hold of K x: their own products, and the transposed ones as
 * far as they belong to these rows. */
FOR_EACH_PROCESSOR
void rockdda_subtract_own(int first, int last, const int *row_start, const int *column, const double *values,
                          const double *f, const double *x, double *r)
{
   memcpy(r + 6 * (long)(first - 1), f + 6 * (long)(first - 1), 6 * (size_t)(last - first + 1) * sizeof(double));
   for (int i = first; i <= last; ++i)
   {
      four y4 = {0, 0, 0, 0}, w4, a4;
      two y2 = {0, 0}, w2, a2;
      const double *w = x + 6 * (long)(i - 1);
      const double *a = values + 36 * (long)(row_start[i - 1] - 1);
      SOON_BLOCK(a, ahead * BLOCK_BYTES);
      LOAD(w4, w2, w);
#pragma GCC unroll 6
      for (int j = 0; j < 6; ++j)
      {
         LOAD(a4, a2, a + 6 * j);
         y4 += a4 * w[j];
         y2 += a2 * w[j];
      }
      for (int k = row_start[i - 1] + 1; k < row_start[i]; ++k)
      {
         const int other = column[k - 1];
         const double *z = x + 6 * (long)(other - 1);
         a = values + 36 * (long)(k - 1);
         SOON_BLOCK(a, ahead * BLOCK_BYTES);
         if (other > last)
         {
#pragma GCC unroll 6
            for (int j = 0; j < 6; ++j)
            {
               LOAD(a4, a2, a + 6 * j);
               y4 += a4 * z[j];
               y2 += a2 * z[j];
            }
            continue;
         }
         two t[6];
#pragma GCC unroll 6
         for (int j = 0; j < 6; ++j)
         {
            LOAD(a4, a2, a + 6 * j);
            y4 += a4 * z[j];
            y2 += a2 * z[j];
            t[j] = TRANSPOSED_LANES(a4, a2, w4, w2);
         }
         double *to = r + 6 * (long)(other - 1);
#pragma GCC unroll 3
         for (int j = 0; j < 6; j += 2)
         {
            two s;
            memcpy(&s, to + j, sizeof s);
            s -= SUM_LANES(t[j], t[j + 1]);
            memcpy(to + j, &s, sizeof s);
         }
      }
      /* in pairs, as it was written last: as a whole it would wait for the memory */
      double *own = r + 6 * (long)(i - 1);
      const two y[3] = {__builtin_shufflevector(y4, y4, 0, 1), __builtin_shufflevector(y4, y4, 2, 3), y2};
#pragma GCC unroll 3
      for (int j = 0; j < 3; ++j)
      {
         memcpy(&a2, own + 2 * j, sizeof a2);
         a2 -= y[j];
         memcpy(own + 2 * j, &a2, sizeof a2);
      }
   }
}

/* r := r less what rows before the first one hold of rows first to last. The neighbours of a row ascend. */
FOR_EACH_PROCESSOR
void rockdda_subtract_foreign(int first, int last, const int *start, const int *neighbour, const int *place,
                              const double *values, const double *x, double *r)
{
   for (int i = first; i <= last; ++i)
   {
      two y[3] = {{0, 0}, {0, 0}, {0, 0}}, s;
      if (i + rows_ahead <= last)
         for (int l = start[i + rows_ahead - 1]; l < start[i + rows_ahead] && neighbour[l - 1] < first; ++l)
            SOON_BLOCK(values + 36 * (long)(place[l - 1] - 1), 0);
      int k = start[i - 1];
      if (k >= start[i] || neighbour[k - 1] >= first)
         continue;
      for (; k < start[i] && neighbour[k - 1] < first; ++k)
      {
         const double *a = values + 36 * (long)(place[k - 1] - 1);
         four a4, w4;
         two a2, w2, t[6];
         LOAD(w4, w2, x + 6 * (long)(neighbour[k - 1] - 1));
#pragma GCC unroll 6
         for (int j = 0; j < 6; ++j)
         {
            LOAD(a4, a2, a + 6 * j);
            t[j] = TRANSPOSED_LANES(a4, a2, w4, w2);
         }
#pragma GCC unroll 3
         for (int j = 0; j < 3; ++j)
            y[j] += SUM_LANES(t[2 * j], t[2 * j + 1]);
      }
      double *own = r + 6 * (long)(i - 1);
#pragma GCC unroll 3
      for (int j = 0; j < 3; ++j)
      {
         memcpy(&s, own + 2 * j, sizeof s);
         s -= y[j];
         memcpy(own + 2 * j, &s, sizeof s);
      }
   }
}
