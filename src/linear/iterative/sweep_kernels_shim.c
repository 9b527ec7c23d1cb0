/* SPDX-License-Identifier: MIT */
/* Sweeps of conjugate gradients over the blocks of one chunk, see rockdda_linear_sweeps. Blocks are packed as in
 * rockdda_linear_kernels. All blocks, rows and places are counted from 1. */
#include "../matrix/triangle_lanes.h"

typedef float single_two __attribute__((vector_size(8)));
typedef float loose_single __attribute__((vector_size(16), aligned(4), may_alias));
typedef float loose_pair __attribute__((vector_size(8), aligned(4), may_alias));

/* Rows of a chunk whose vectors are updated, and then swept, while they are in the first cache. */
enum { batch = 32 };
/* Bytes by which the backward sweep fetches couplings before it comes to them, and rows the other way. */
enum { ahead = 2304, rows_ahead = 8 };

/* Numbers 1 and 2 of a vector, 3 and 4, 5 and 6, each twice in a row: x1 x1 x2 x2. Numbers 1 to 4 and 5 to 6 are read
 * as they were written: what is put together from both would wait for the memory. */
#define SPREAD(x, x12, x34, x56) \
   do \
   { \
      const single_four head_ = *(const loose_single *)(x); \
      const single_two tail_ = *(const loose_pair *)((x) + 4); \
      x12 = __builtin_shufflevector(head_, head_, 0, 0, 1, 1); \
      x34 = __builtin_shufflevector(head_, head_, 2, 2, 3, 3); \
      x56 = __builtin_shufflevector(tail_, tail_, 0, 0, 1, 1); \
   } while (0)

#define TILE(a, k) (*(const loose_single *)((a) + 4 * (k)))

/* u, v, w := u, v, w - A x for a packed block. */
#define SUBTRACT_PRODUCT(a, x, u, v, w) \
   do \
   { \
      single_four x12_, x34_, x56_; \
      SPREAD(x, x12_, x34_, x56_); \
      u -= (TILE(a, 0) * x12_ + TILE(a, 1) * x34_) + TILE(a, 2) * x56_; \
      v -= (TILE(a, 3) * x12_ + TILE(a, 4) * x34_) + TILE(a, 5) * x56_; \
      w -= (TILE(a, 6) * x12_ + TILE(a, 7) * x34_) + TILE(a, 8) * x56_; \
   } while (0)

/* The six numbers that lanes 1 and 3, 2 and 4 of u, v and w add up to. */
#define ROW_SUM(u, v, w, s4, s2) \
   ((s4) = __builtin_shufflevector(u, v, 0, 1, 4, 5) + __builtin_shufflevector(u, v, 2, 3, 6, 7), \
    (s2) = __builtin_shufflevector(w, w, 0, 1) + __builtin_shufflevector(w, w, 2, 3))
/* The same of lanes 1 and 2, 3 and 4. */
#define PAIR_SUM(u, v, w, s4, s2) \
   ((s4) = __builtin_shufflevector(u, v, 0, 2, 4, 6) + __builtin_shufflevector(u, v, 1, 3, 5, 7), \
    (s2) = __builtin_shufflevector(w, w, 0, 2) + __builtin_shufflevector(w, w, 1, 3))

#define LOAD_SINGLE(x4, x2, from) ((x4) = *(const loose_single *)(from), (x2) = *(const loose_pair *)((from) + 4))
#define STORE_SINGLE(x4, x2, to) (*(loose_single *)(to) = (x4), *(loose_pair *)((to) + 4) = (x2))

/* r := weight G^-1 f, and with `sweeps` r := (I + L)^-1 r, from the first row to the last. G^-1 of row i is in scale,
 * its f in block[i]. */
FOR_EACH_PROCESSOR
void rockdda_start_rows(int first, int last, int sweeps, const int *lower_start, const int *lower_column,
                        const float *lower, const double *scale, const int *block, double weight, const double *f,
                        float *r)
{
   for (int i = first; i <= last; ++i)
   {
      const double *a = f + 6 * (long)(block[i - 1] - 1);
      if (i + rows_ahead <= last)
         SOON(f + 6 * (long)(block[i + rows_ahead - 1] - 1), 0);
      four s4[6];
      two s2[6];
      UNPACK(scale + 21 * (long)(i - 1), s4, s2);
      const four b4 = weight * SCALE_UPPER(s4, a);
      const two b2 = weight * (((s2[0] * a[0] + s2[1] * a[1]) + (s2[2] * a[2] + s2[3] * a[3])) +
                               (s2[4] * a[4] + s2[5] * a[5]));
      single_four r4 = __builtin_convertvector(b4, single_four);
      single_two r2 = __builtin_convertvector(b2, single_two);
      if (sweeps)
      {
         single_four u = {0, 0, 0, 0}, v = u, w = u, e4;
         single_two e2;
         for (int k = lower_start[i - 1]; k < lower_start[i]; ++k)
            SUBTRACT_PRODUCT(lower + 36 * (long)(k - 1), r + 6 * (long)(lower_column[k - 1] - 1), u, v, w);
         ROW_SUM(u, v, w, e4, e2);
         r4 += e4;
         r2 += e2;
      }
      STORE_SINGLE(r4, r2, r + 6 * (long)(i - 1));
   }
}

/* x := x + norm G^-T (d + alpha t) of the blocks in rows first to last. */
FOR_EACH_PROCESSOR
void rockdda_add_scaled(int first, int last, const double *scale, const int *block, double norm, float alpha,
                        const float *d, const float *t, double *x)
{
   for (int i = first; i <= last; ++i)
   {
      const long at = 6 * (long)(i - 1);
      single_four d4, t4;
      single_two d2, t2;
      four s4[6], x4;
      two s2[6], x2;
      LOAD_SINGLE(d4, d2, d + at);
      LOAD_SINGLE(t4, t2, t + at);
      const four v4 = norm * __builtin_convertvector(d4 + alpha * t4, four);
      const two v2 = norm * __builtin_convertvector(d2 + alpha * t2, two);
      UNPACK(scale + 21 * (long)(i - 1), s4, s2);
#pragma GCC unroll 4
      for (int j = 0; j < 4; ++j)
         s4[j] *= v4;
#pragma GCC unroll 6
      for (int j = 0; j < 6; ++j)
         s2[j] *= v2;
      const four e = __builtin_shufflevector(s4[0], s4[1], 0, 4, 2, 6) +
                     __builtin_shufflevector(s4[0], s4[1], 1, 5, 3, 7);
      const four g = __builtin_shufflevector(s4[2], s4[3], 0, 4, 2, 6) +
                     __builtin_shufflevector(s4[2], s4[3], 1, 5, 3, 7);
      const four h = __builtin_shufflevector(SUM_LANES(s2[0], s2[1]), SUM_LANES(s2[2], s2[3]), 0, 1, 2, 3);
      double *to = x + 6 * (long)(block[i - 1] - 1);
      if (i + rows_ahead <= last)
         SOON(x + 6 * (long)(block[i + rows_ahead - 1] - 1), 0);
      LOAD(x4, x2, to);
      x4 += (__builtin_shufflevector(e, g, 0, 1, 4, 5) + __builtin_shufflevector(e, g, 2, 3, 6, 7)) + h;
      x2 += SUM_LANES(s2[4], s2[5]);
      STORE(x4, x2, to);
   }
}

/* t := (I + L)^-T s from row `end` to row `begin` of a chunk that begins with row `first`. */
static inline __attribute__((always_inline)) void sweep_rows(int first, int begin, int end, const int *upper_start,
                                                             const int *upper_column, const float *upper,
                                                             const int *own_start, const int *lower_start,
                                                             const int *lower_column, const float *lower,
                                                             const float *s, float *t, float *back_sum)
{
   const single_four zero = {0, 0, 0, 0};
   for (int i = end; i >= begin; --i)
   {
      float *own = back_sum + 12 * (long)(i - first);
      single_four u = TILE(own, 0), v = TILE(own, 1), w = TILE(own, 2), s4, b4, e4;
      single_two s2, b2, e2;
#pragma GCC unroll 3
      for (int k = 0; k < 3; ++k)
         ((loose_single *)own)[k] = zero;
      PAIR_SUM(u, v, w, e4, e2);
      LOAD_SINGLE(s4, s2, s + 6 * (long)(i - 1));
      b4 = s4 + e4;
      b2 = s2 + e2;
      /* rows of `upper` lie in the order of the sweep */
      if (upper_start[i] < upper_start[i - 1])
      {
         u = v = w = zero;
         for (int k = upper_start[i]; k < upper_start[i - 1]; ++k)
            SUBTRACT_PRODUCT(upper + 36 * (long)(k - 1), t + 6 * (long)(upper_column[k - 1] - 1), u, v, w);
         ROW_SUM(u, v, w, e4, e2);
         b4 += e4;
         b2 += e2;
      }
      STORE_SINGLE(b4, b2, t + 6 * (long)(i - 1));
      const single_four t1 = __builtin_shufflevector(b4, b4, 0, 1, 0, 1);
      const single_four t2 = __builtin_shufflevector(b4, b4, 2, 3, 2, 3);
      const single_four t3 = __builtin_shufflevector(b2, b2, 0, 1, 0, 1);
      for (int k = own_start[i - 1]; k < lower_start[i]; ++k)
      {
         const float *a = lower + 36 * (long)(k - 1);
         SOON(a, -ahead), SOON(a, 64 - ahead), SOON(a, 128 - ahead);
         loose_single *sums = (loose_single *)(back_sum + 12 * (long)(lower_column[k - 1] - first));
         sums[0] -= (TILE(a, 0) * t1 + TILE(a, 3) * t2) + TILE(a, 6) * t3;
         sums[1] -= (TILE(a, 1) * t1 + TILE(a, 4) * t2) + TILE(a, 7) * t3;
         sums[2] -= (TILE(a, 2) * t1 + TILE(a, 5) * t2) + TILE(a, 8) * t3;
      }
   }
}

/* t := (I + L)^-T s from the last row to the first. `back_sum` has room for them, and is zero
 * before and after. */
FOR_EACH_PROCESSOR
void rockdda_sweep_backward(int first, int last, const int *upper_start, const int *upper_column, const float *upper,
                            const int *own_start, const int *lower_start, const int *lower_column, const float *lower,
                            const float *s, float *t, float *back_sum)
{
   sweep_rows(first, first, last, upper_start, upper_column, upper, own_start, lower_start, lower_column, lower, s, t,
              back_sum);
}

/* d := d + alpha t, r := r - alpha (q + t), p := r + beta p, and then t := (I + L)^-T p as above. */
FOR_EACH_PROCESSOR
void rockdda_update_and_sweep(int first, int last, const int *upper_start, const int *upper_column, const float *upper,
                              const int *own_start, const int *lower_start, const int *lower_column,
                              const float *lower, float alpha, float beta, const float *q, float *d, float *r, float *p,
                              float *t, float *back_sum)
{
   for (int end = last; end >= first; end -= batch)
   {
      const int begin = end - batch + 1 > first ? end - batch + 1 : first;
      const long from = 6 * (long)(begin - 1);
      const int n = 6 * (end - begin + 1);
      const float *restrict q_ = q + from, *restrict t_ = t + from;
      float *restrict d_ = d + from, *restrict r_ = r + from, *restrict p_ = p + from;
      for (int k = 0; k < n; ++k)
      {
         d_[k] = d_[k] + alpha * t_[k];
         r_[k] = r_[k] - alpha * (q_[k] + t_[k]);
         p_[k] = r_[k] + beta * p_[k];
      }
      sweep_rows(first, begin, end, upper_start, upper_column, upper, own_start, lower_start, lower_column, lower, p, t,
                 back_sum);
   }
}

/* q := (I + L)^-1 (p + N t) from the first row to the last, and the sums r r, p v, r v and v v with v = q + t. */
FOR_EACH_PROCESSOR
void rockdda_sweep_forward(int first, int last, const int *lower_start, const int *lower_column, const float *lower,
                           const float *remainder, const float *r, const float *p, const float *t, float *q,
                           double *total)
{
   four rr4 = {0, 0, 0, 0}, pv4 = rr4, rv4 = rr4, vv4 = rr4;
   two rr2 = {0, 0}, pv2 = rr2, rv2 = rr2, vv2 = rr2;
   for (int i = first; i <= last; ++i)
   {
      const long at = 6 * (long)(i - 1);
      single_four u = {0, 0, 0, 0}, v = u, w = u, x4, q4;
      single_two x2, q2;
      const float *rest = remainder + 36 * (long)(i - 1);
      SOON(rest, ahead), SOON(rest, ahead + 64), SOON(rest, ahead + 128);
      SUBTRACT_PRODUCT(rest, t + at, u, v, w);
      for (int k = lower_start[i - 1]; k < lower_start[i]; ++k)
         SUBTRACT_PRODUCT(lower + 36 * (long)(k - 1), q + 6 * (long)(lower_column[k - 1] - 1), u, v, w);
      ROW_SUM(u, v, w, q4, q2);
      LOAD_SINGLE(x4, x2, p + at);
      q4 = x4 + q4;
      q2 = x2 + q2;
      STORE_SINGLE(q4, q2, q + at);
      const four p4 = __builtin_convertvector(x4, four);
      const two p2 = __builtin_convertvector(x2, two);
      LOAD_SINGLE(x4, x2, t + at);
      q4 += x4;
      q2 += x2;
      const four v4 = __builtin_convertvector(q4, four);
      const two v2 = __builtin_convertvector(q2, two);
      LOAD_SINGLE(x4, x2, r + at);
      const four r4 = __builtin_convertvector(x4, four);
      const two r2 = __builtin_convertvector(x2, two);
      rr4 += r4 * r4;
      rr2 += r2 * r2;
      pv4 += p4 * v4;
      pv2 += p2 * v2;
      rv4 += r4 * v4;
      rv2 += r2 * v2;
      vv4 += v4 * v4;
      vv2 += v2 * v2;
   }
#define TOTAL(x4, x2) (((((x4[0] + x4[1]) + x4[2]) + x4[3]) + x2[0]) + x2[1])
   total[0] = TOTAL(rr4, rr2);
   total[1] = TOTAL(pv4, pv2);
   total[2] = TOTAL(rv4, rv2);
   total[3] = TOTAL(vv4, vv2);
}
