/* SPDX-License-Identifier: MIT */
/* Products and quotients of 6x6 blocks, column by column, for a Cholesky factor by blocks. */
#include "block_lanes.h"

/* Copies of n blocks of the matrix, which follow one another from number `first` of c on: transposed when the place is
 * negative, zero when it is 0; all counted from 1. */
FOR_EACH_PROCESSOR
void rockdda_take_blocks(int first, int n, const int *place, const double *values, double *c)
{
   place += first - 1;
   c += 36 * (long)(first - 1);
   for (int q = 0; q < n; ++q, c += 36)
   {
      if (place[q] == 0)
      {
         memset(c, 0, 36 * sizeof(double));
         continue;
      }
      four a4[6];
      two a2[6];
      TAKE(values, place[q], a4, a2);
#pragma GCC unroll 6
      for (int j = 0; j < 6; ++j)
         STORE(a4[j], a2[j], c + 6 * j);
   }
}

/* C := C - A B^T and D := D - E B^T: rows 5 and 6 of both fill a vector. */
static inline __attribute__((always_inline)) void subtract_two(const double *a, const double *e, const double *b,
                                                               double *c, double *d)
{
   four tail[6];
   two t, u;
#pragma GCC unroll 6
   for (int m = 0; m < 6; ++m)
   {
      memcpy(&t, a + 6 * m + 4, sizeof(two));
      memcpy(&u, e + 6 * m + 4, sizeof(two));
      tail[m] = __builtin_shufflevector(t, u, 0, 1, 2, 3);
   }
#pragma GCC unroll 6
   for (int j = 0; j < 6; ++j)
   {
      four s4, r4, w4, a4, e4;
      LOAD(s4, t, c + 6 * j);
      LOAD(r4, u, d + 6 * j);
      w4 = __builtin_shufflevector(t, u, 0, 1, 2, 3);
#pragma GCC unroll 6
      for (int m = 0; m < 6; ++m)
      {
         const double x = b[6 * m + j];
         memcpy(&a4, a + 6 * m, sizeof(four));
         memcpy(&e4, e + 6 * m, sizeof(four));
         s4 -= a4 * x;
         r4 -= e4 * x;
         w4 -= tail[m] * x;
      }
      t = __builtin_shufflevector(w4, w4, 0, 1);
      u = __builtin_shufflevector(w4, w4, 2, 3);
      STORE(s4, t, c + 6 * j);
      STORE(r4, u, d + 6 * j);
   }
}

/* C := C - A A^T, at least its lower half. */
static inline __attribute__((always_inline)) void subtract_square(const double *a, double *c)
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

/* What the blocks L_jk in row j of the factor, p = source[first] to source[last], take off column j of the matrix:
 * own := own - L_jk L_jk^T, at least its lower half, and C_t := C_t - L_ik L_jk^T for the blocks L_ik after it in
 * column k, t = target[first_target[p]] and the next ones. All are counted from 1; start[column[p] + 1] is the block
 * after those of column k. */
FOR_EACH_PROCESSOR
void rockdda_subtract_sources(int first, int last, const int *source, const int *column, const int *start,
                              const int *first_target, const int *target, double *own, double *lower)
{
   for (int s = first - 1; s < last; ++s)
   {
      const int p = source[s], n = start[column[p - 1]] - p;
      const int *t = target + first_target[p - 1] - 1;
      const double *b = lower + 36 * (long)(p - 1);
      if (n % 2 > 0)
         subtract_square(b, own);
      for (int q = n % 2; q < n; q += 2)
         subtract_two(b + 36 * q, b + 36 * (q + 1), b, q > 0 ? lower + 36 * (long)(t[q - 1] - 1) : own,
                      lower + 36 * (long)(t[q] - 1));
   }
}

/* X := X L^-T for columns of four rows, given the entries of L with the reciprocals of its diagonal. */
static inline __attribute__((always_inline)) void divide_rows(const four (*l)[6], four *x)
{
   x[0] = x[0] * l[0][0];
   x[1] = (x[1] - x[0] * l[1][0]) * l[1][1];
   x[2] = (x[2] - (x[0] * l[2][0] + x[1] * l[2][1])) * l[2][2];
   x[3] = (x[3] - ((x[0] * l[3][0] + x[1] * l[3][1]) + x[2] * l[3][2])) * l[3][3];
   x[4] = (x[4] - ((x[0] * l[4][0] + x[1] * l[4][1]) + (x[2] * l[4][2] + x[3] * l[4][3]))) * l[4][4];
   x[5] = (x[5] - (((x[0] * l[5][0] + x[1] * l[5][1]) + (x[2] * l[5][2] + x[3] * l[5][3])) + x[4] * l[5][4])) * l[5][5];
}

/* C := C L^-T for n blocks, which follow one another from number `first` of c on, counted from 1, with a lower triangle
 * L that has the reciprocals of its diagonal. */
FOR_EACH_PROCESSOR
void rockdda_divide_blocks(int first, int n, const double *l, double *c)
{
   four each[6][6], x[6];
   two t, u;
   for (int j = 0; j < 6; ++j)
      for (int i = j; i < 6; ++i)
         each[i][j] = (four){l[6 * j + i], l[6 * j + i], l[6 * j + i], l[6 * j + i]};
   c += 36 * (long)(first - 1);
   for (int q = 0; q < n; ++q, c += 36)
   {
#pragma GCC unroll 6
      for (int j = 0; j < 6; ++j)
         memcpy(&x[j], c + 6 * j, sizeof(four));
      divide_rows(each, x);
#pragma GCC unroll 6
      for (int j = 0; j < 6; ++j)
         memcpy(c + 6 * j, &x[j], sizeof(four));
      if (q % 2 == 0 && q + 1 < n)
         continue;
      /* rows 5 and 6 of two blocks, or twice those of the last one */
      double *before = q % 2 > 0 ? c - 36 : c;
#pragma GCC unroll 6
      for (int j = 0; j < 6; ++j)
      {
         memcpy(&t, before + 6 * j + 4, sizeof(two));
         memcpy(&u, c + 6 * j + 4, sizeof(two));
         x[j] = __builtin_shufflevector(t, u, 0, 1, 2, 3);
      }
      divide_rows(each, x);
#pragma GCC unroll 6
      for (int j = 0; j < 6; ++j)
      {
         t = __builtin_shufflevector(x[j], x[j], 0, 1);
         u = __builtin_shufflevector(x[j], x[j], 2, 3);
         memcpy(before + 6 * j + 4, &t, sizeof(two));
         memcpy(c + 6 * j + 4, &u, sizeof(two));
      }
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
