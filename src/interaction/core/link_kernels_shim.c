/* SPDX-License-Identifier: MIT */
/* Sums over links with their packed vectors (rockdda_interaction_link_vectors), four numbers at a time.
 *
 * Of the vectors of one block the first two numbers are s n and s t, with n = p[0:2], t = (-n2, n1) and s = 1 for the
 * first block, -1 for the second; the other four are p[2:6] and p[6:10], or p[10:14] and p[14:18]. Both n and t are
 * held twice in four numbers. */
#include "link_lanes.h"

#include <math.h>

#define LINK_NUMBERS 18

/* Bytes by which vectors of links are asked for before they are needed. */
enum { ahead = 3456 };

static inline int is_zero(const double *pair)
{
   return !(fabs(pair[0]) > 0 || fabs(pair[1]) > 0);
}

/* Line 1 and 2 of the link c > 0 for its first block, c < 0 for its second: n, t, and where the other numbers begin. */
#define UNPACK(c, p, n, t, rest)                                                                                       \
   const double *p = vectors + LINK_NUMBERS * ((long)((c) > 0 ? (c) : -(c)) - 1);                                      \
   const double *rest = p + ((c) > 0 ? 2 : 10);                                                                        \
   const long long side = (c) > 0 ? 0 : SIGN;                                                                          \
   const four n = FLIP(JOIN(p, p), ((mask){side, side, side, side}));                                                  \
   const four t = NORMAL_TO(n);

/* Elongations of n links with two blocks along both lines, for the unknowns x: sums of six, of odd and even terms. */
FOR_EACH_PROCESSOR
void rockdda_many_elongations(int n, const double *vectors, const int *pair, const double *x, double *along)
{
   const double *p = vectors;
   for (int l = 0; l < n; ++l, p += LINK_NUMBERS)
   {
      SOON(p, ahead), SOON(p, ahead + 64), SOON(p, ahead + 128);
      const double *a = x + 6 * (long)(pair[2 * l] - 1), *b = x + 6 * (long)(pair[2 * l + 1] - 1);
      const four nn = JOIN(p, p);
      const four lines = FLIP(PICK(nn, nn, 0, 1, 3, 2), ((mask){0, 0, SIGN, 0}));
      const four on_a = (lines * JOIN(a, a) + JOIN(p + 2, p + 6) * JOIN(a + 2, a + 2)) +
                        JOIN(p + 4, p + 8) * JOIN(a + 4, a + 4);
      const four on_b = (JOIN(p + 10, p + 14) * JOIN(b + 2, b + 2) - lines * JOIN(b, b)) +
                        JOIN(p + 12, p + 16) * JOIN(b + 4, b + 4);
      const four sum = on_a + on_b;
      along[2 * l] = sum[0] + sum[1];
      along[2 * l + 1] = sum[2] + sum[3];
   }
}

/* Forces of the n links of a block, c < 0 as their second block, with their signs and without. */
FOR_EACH_PROCESSOR
void rockdda_add_loads(int n_links, const int *incident, const double *vectors, const double *force, double *f,
                       double *magnitude)
{
   const mask all = {~SIGN, ~SIGN, ~SIGN, ~SIGN}, upper = {-1, -1, ~SIGN, ~SIGN};
   four f2 = JOIN(f, magnitude), f4, m4, v, w;
   LOAD(f4, f + 2);
   LOAD(m4, magnitude + 2);
   for (int l = 0; l < n_links; ++l)
   {
      const int c = incident[l];
      const double *along = force + 2 * ((long)(c > 0 ? c : -c) - 1);
      if (is_zero(along))
         continue;
      UNPACK(c, p, n, t, rest)
      LOAD(v, rest);
      LOAD(w, rest + 4);
      v = along[0] * v;
      w = along[1] * w;
      f4 += v + w;
      m4 += (four)((mask)v & all) + (four)((mask)w & all);
      f2 += (four)((mask)(along[0] * n) & upper) + (four)((mask)(along[1] * t) & upper);
   }
   f[0] = f2[0];
   f[1] = f2[1];
   magnitude[0] = f2[2];
   magnitude[1] = f2[3];
   STORE(f4, f + 2);
   STORE(m4, magnitude + 2);
}

/* Forces of the n links of a block. */
FOR_EACH_PROCESSOR
void rockdda_add_forces(int n_links, const int *incident, const double *vectors, const double *force, double *f)
{
   four f2 = JOIN(f, f), f4, v, w;
   LOAD(f4, f + 2);
   for (int l = 0; l < n_links; ++l)
   {
      const int c = incident[l];
      const double *along = force + 2 * ((long)(c > 0 ? c : -c) - 1);
      if (is_zero(along))
         continue;
      UNPACK(c, p, n, t, rest)
      LOAD(v, rest);
      LOAD(w, rest + 4);
      f4 += along[0] * v + along[1] * w;
      f2 += along[0] * n + along[1] * t;
   }
   f[0] = f2[0];
   f[1] = f2[1];
   STORE(f4, f + 2);
}

/* A coupling, in pairs of columns for rows 1 to 2, and in columns for rows 3 to 6. */
#define LOAD_COUPLING                                                                                                  \
   {                                                                                                                   \
      m12 = JOIN(m, m + 6), m35 = JOIN(m + 12, m + 24), m46 = JOIN(m + 18, m + 30);                                    \
      LOAD(m1, m + 2), LOAD(m2, m + 8), LOAD(m3, m + 14), LOAD(m4, m + 20), LOAD(m5, m + 26), LOAD(m6, m + 32);        \
   }
#define STORE_COUPLING                                                                                                 \
   {                                                                                                                   \
      PART(m12, m, m + 6), PART(m35, m + 12, m + 24), PART(m46, m + 18, m + 30);                                       \
      STORE(m1, m + 2), STORE(m2, m + 8), STORE(m3, m + 14), STORE(m4, m + 20), STORE(m5, m + 26), STORE(m6, m + 32);  \
   }

/* Vector of line 1 of a link, for its first or second block. */
static inline void unpack_normal(const double *p, int is_first, double *v)
{
   const double *rest = p + (is_first ? 2 : 10);
   v[0] = is_first ? p[0] : -p[0];
   v[1] = is_first ? p[1] : -p[1];
   for (int k = 0; k < 4; ++k)
      v[2 + k] = rest[k];
}

/* Coupling of a link with the one that follows it in the table, along line 1: k (v w^T + w v^T) on the diagonal block of
 * one of their blocks, and its coupling with the other block if that is stored (row and column of it: K_ij). */
static void couple(double k, const double *p, int is_first, double *diagonal, double *other)
{
   double v[6], w[6], a[6], b[6];
   unpack_normal(p, is_first, v);
   unpack_normal(p + LINK_NUMBERS, is_first, w);
   for (int j = 0; j < 6; ++j)
      for (int i = 0; i < 6; ++i)
         diagonal[6 * j + i] += k * (v[i] * w[j] + w[i] * v[j]);
   if (!other)
      return;
   unpack_normal(p, !is_first, a);
   unpack_normal(p + LINK_NUMBERS, !is_first, b);
   for (int j = 0; j < 6; ++j)
      for (int i = 0; i < 6; ++i)
         other[6 * j + i] += k * (v[i] * b[j] + w[i] * a[j]);
}

/* Stiffness of the n links of block i and its own terms, of which the lower half counts, as its diagonal block;
 * stiffness of the links as its n couplings with blocks of larger numbers, which follow the diagonal block. */
FOR_EACH_PROCESSOR
void rockdda_add_stiffness(int i, int n_links, const int *incident, const int *pair, const int *slot,
                           const double *vectors, const double *stiffness, const double *coupling, const double *terms,
                           int diagonal_slot, int n_couplings, double *values)
{
   double *diagonal = values + 36 * (long)(diagonal_slot - 1);
   /* rows and columns 1 to 2; rows 3 to 6 of columns 1 and 2; of columns 3 to 6, of which the upper half counts */
   four d = {terms[0], terms[1], terms[1], terms[6]}, d1, d2, v, w;
   four d3 = {terms[11], 0, 0, 0}, d4 = {terms[12], terms[15], 0, 0}, d5 = {terms[13], terms[16], terms[18], 0};
   four d6 = {terms[14], terms[17], terms[19], terms[20]};
   LOAD(d1, terms + 2);
   LOAD(d2, terms + 7);
   for (int l = 0; l < n_links; ++l)
   {
      const int c = incident[l];
      const double *k = stiffness + 2 * ((long)(c > 0 ? c : -c) - 1);
      if (is_zero(k))
         continue;
      UNPACK(c, p, n, t, rest)
      LOAD(v, rest);
      LOAD(w, rest + 4);
      const four kn = k[0] * n, kt = k[1] * t, kv = k[0] * v, kw = k[1] * w;
      const four kn1 = FIRST(kn), kn2 = SECOND(kn), kt1 = FIRST(kt), kt2 = SECOND(kt);
      d += LOW_AND_HIGH(kn1, kn2) * n + LOW_AND_HIGH(kt1, kt2) * t;
      d1 += kn1 * v + kt1 * w;
      d2 += kn2 * v + kt2 * w;
      d3 += kv * rest[0] + kw * rest[4];
      d4 += kv * rest[1] + kw * rest[5];
      d5 += kv * rest[2] + kw * rest[6];
      d6 += kv * rest[3] + kw * rest[7];
   }
   diagonal[0] = d[0];
   diagonal[1] = diagonal[6] = d[1];
   diagonal[7] = d[3];
   STORE(d1, diagonal + 2);
   STORE(d2, diagonal + 8);
   diagonal[12] = d1[0], diagonal[13] = d2[0];
   diagonal[18] = d1[1], diagonal[19] = d2[1];
   diagonal[24] = d1[2], diagonal[25] = d2[2];
   diagonal[30] = d1[3], diagonal[31] = d2[3];
   diagonal[14] = d3[0];
   diagonal[15] = diagonal[20] = d4[0];
   diagonal[16] = diagonal[26] = d5[0];
   diagonal[17] = diagonal[32] = d6[0];
   diagonal[21] = d4[1];
   diagonal[22] = diagonal[27] = d5[1];
   diagonal[23] = diagonal[33] = d6[1];
   diagonal[28] = d5[2];
   diagonal[29] = diagonal[34] = d6[2];
   diagonal[35] = d6[3];

   memset(diagonal + 36, 0, 36 * (size_t)n_couplings * sizeof(double));
   double *m = 0;
   four m12 = {0}, m35 = {0}, m46 = {0}, m1 = {0}, m2 = {0}, m3 = {0}, m4 = {0}, m5 = {0}, m6 = {0};
   for (int l = 0; l < n_links; ++l)
   {
      const int c = incident[l];
      const long link = (c > 0 ? c : -c) - 1;
      const double *k = stiffness + 2 * link;
      if (slot[link] <= 0 || i >= pair[2 * link + (c > 0)] || is_zero(k))
         continue;
      double *here = values + 36 * (long)(slot[link] - 1);
      /* links with the same block often follow one another */
      if (here != m)
      {
         if (m)
            STORE_COUPLING
         m = here;
         LOAD_COUPLING
      }
      UNPACK(c, p, n, t, rest)
      const double *other = p + (c > 0 ? 10 : 2);
      four a, b;
      LOAD(v, rest);
      LOAD(w, rest + 4);
      LOAD(a, other);
      LOAD(b, other + 4);
      const four kn = -(k[0] * n), kt = -(k[1] * t), ka = k[0] * a, kb = k[1] * b;
      const four kn1 = FIRST(kn), kn2 = SECOND(kn), kt1 = FIRST(kt), kt2 = SECOND(kt);
      const four a35 = FIRST(ka), a46 = SECOND(ka), b35 = FIRST(kb), b46 = SECOND(kb);
      m12 += LOW_AND_HIGH(kn1, kn2) * n + LOW_AND_HIGH(kt1, kt2) * t;
      m1 += kn1 * v + kt1 * w;
      m2 += kn2 * v + kt2 * w;
      m35 += a35 * n + b35 * t;
      m46 += a46 * n + b46 * t;
      m3 += LOW(a35) * v + LOW(b35) * w;
      m4 += LOW(a46) * v + LOW(b46) * w;
      m5 += HIGH(a35) * v + HIGH(b35) * w;
      m6 += HIGH(a46) * v + HIGH(b46) * w;
   }
   if (m)
      STORE_COUPLING

   for (int l = 0; l < n_links; ++l)
   {
      const int c = incident[l];
      const long link = (c > 0 ? c : -c) - 1;
      if (!(fabs(coupling[link]) > 0))
         continue;
      double *here = slot[link] > 0 && i < pair[2 * link + (c > 0)] ? values + 36 * (long)(slot[link] - 1) : 0;
      couple(coupling[link], vectors + LINK_NUMBERS * link, c > 0, diagonal, here);
   }
}
