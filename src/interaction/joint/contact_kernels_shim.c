/* SPDX-License-Identifier: MIT */
/* Vectors of gap and slip of contacts, their lengths and places (rockdda_interaction_contact_lengths), seen from both
 * blocks at once.
 *
 * The first half of four numbers belongs to the view in which block a has the vertex and block b the edge, the second
 * half to that in which b has the vertex and a the edge, with the normal reversed; x and y of both. Single numbers of a
 * block are held twice in its half. */
#include "../core/link_lanes.h"

#include <math.h>

#define LINK_NUMBERS 18

/* moving_block_type of rockdda_interaction_finite_rotation. */
typedef struct
{
   double centroid[2], d[6], angle, half[2], full[2], chord;
} moving_block;

/* moved_block_type of the same module; the gradient by columns. */
typedef struct
{
   double centroid[2], shift[2], gradient[4];
} moved_block;

/* -v in the second half, and in both. */
#define REVERSE_SECOND(v) FLIP(v, ((mask){0, 0, SIGN, SIGN}))
#define NEGATIVE(v) FLIP(v, ((mask){SIGN, SIGN, SIGN, SIGN}))
/* v turned by an angle, of which the cosine is given twice, and the sine with the signs (-, +). */
#define COSINE(angle) FIRST(angle)
#define SINE(angle) FLIP(SECOND(angle), ((mask){SIGN, 0, SIGN, 0}))
#define TURNED(v, cosine, sine) ((cosine) * (v) + (sine) * TURN(v))
/* v.w of each view, twice. */
#define DOT(v, w) (FIRST((v) * (w)) + SECOND((v) * (w)))
/* H v with the columns of H. */
#define TIMES(h1, h2, v) ((h1) * FIRST(v) + (h2) * SECOND(v))

/* T^T f without its first two numbers: (4, 5) of a force f turned back, (3, 6) of f on the arm mid. */
#define ON_ARM(f, back, mid, x, f36, f45)                                                                              \
   four f36, f45;                                                                                                      \
   {                                                                                                                   \
      const four moment = (mid) * TURN(f), shear = (x) * TURN(back);                                                   \
      f36 = ((four){1, 0.5, 1, 0.5}) * (PICK(moment, shear, 0, 4, 2, 6) +                                              \
                                        FLIP(PICK(moment, shear, 1, 5, 3, 7), ((mask){SIGN, 0, SIGN, 0})));            \
      f45 = (x) * (back);                                                                                              \
   }

/* T d of a point on an arm; linear where a block does not turn, in the order of `displacement_at`. */
#define DISPLACEMENT(k, mid, x, u)                                                                                     \
   four u;                                                                                                             \
   {                                                                                                                   \
      const four rigid = k##_d12 + k##_d3 * NORMAL_TO(mid), stretch = k##_d45 * (x), shear = k##_d6 * TURN(x);         \
      const four strain = stretch + shear, turning = rigid + TURNED(strain, k##_full_cos, k##_full_sin);               \
      const four straight = (rigid + stretch) + shear;                                                                 \
      u = (four)(((mask)turning & k##_turns) | ((mask)straight & ~k##_turns));                                         \
   }

/* Where contact c slips: `lean` from its point, at each block. */
#define PLACE_OF_SLIP(c, n)                                                                                            \
   ((JOIN(point + 2 * (c), point + 2 * (c)) + JOIN(lean + 3 * (c), lean + 3 * (c))) + (0.5 * lean[3 * (c) + 2]) * (n))

/* Vectors of n contacts, rows[0] to rows[n - 1] of the table, counted from 1. */
FOR_EACH_PROCESSOR
void rockdda_place_contacts(int n_rows, const int *rows, const int *block_a, const int *block_b, const double *point,
                            const double *distance, const double *normal, const double *shares, const double *lean,
                            const moving_block *moving, double *vectors)
{
   for (int l = 0; l < n_rows; ++l)
   {
      const long c = rows[l] - 1;
      const moving_block *a = moving + (block_a[c] - 1), *b = moving + (block_b[c] - 1);
      const double gap = distance[c], share = shares[c];
      const four n = REVERSE_SECOND(JOIN(normal + 2 * c, normal + 2 * c)), t = NORMAL_TO(n);
      four p = JOIN(point + 2 * c, point + 2 * c);
      /* a point half-way between the blocks */
      if (share > 0 && share < 1)
         p += (0.5 * gap) * n;
      const four gap_n = gap * n, foot = p - gap_n;
      const four a_centroid = JOIN(a->centroid, b->centroid), b_centroid = SWAP(a_centroid);
      const four beside = PLACE_OF_SLIP(c, n);
      const four on_a = p - a_centroid, on_foot = foot - b_centroid;
      const four on_a2 = beside - a_centroid, on_b = beside - b_centroid;
      four e1, e136, e145, g136, g145, e236, e245, g236, g245;
      if (a->angle == 0 && b->angle == 0)
      {
         ON_ARM(n, n, on_a, on_a, ea36, ea45)
         ON_ARM(n, n, on_foot, on_foot, ga36, ga45)
         ON_ARM(t, t, on_a2, on_a2, eb36, eb45)
         ON_ARM(t, t, on_b, on_b, gb36, gb45)
         e1 = n;
         e136 = ea36, e145 = ea45, e236 = eb36, e245 = eb45;
         g136 = NEGATIVE(ga36), g145 = NEGATIVE(ga45), g236 = NEGATIVE(gb36), g245 = NEGATIVE(gb45);
      }
      else
      {
         const four a_half = JOIN(a->half, b->half), a_full = JOIN(a->full, b->full);
         const four a_chord = TWICE(a->chord, b->chord), b_chord = SWAP(a_chord);
         const four a_d12 = JOIN(a->d, b->d), a_d3 = TWICE(a->d[2], b->d[2]), a_d45 = JOIN(a->d + 3, b->d + 3);
         const four a_d6 = 0.5 * TWICE(a->d[5], b->d[5]), a_angle = TWICE(a->angle, b->angle);
         const four b_d12 = SWAP(a_d12), b_d3 = SWAP(a_d3), b_d45 = SWAP(a_d45), b_d6 = SWAP(a_d6);
         const mask a_turns = (mask)(a_angle != 0), b_turns = SWAP(a_turns);
         const four a_full_cos = COSINE(a_full), a_full_sin = SINE(a_full);
         const four b_full_cos = SWAP(a_full_cos), b_full_sin = SWAP(a_full_sin);
         const four a_cos = COSINE(a_half), a_sin = SINE(a_half), b_cos = SWAP(a_cos), b_sin = SWAP(a_sin);
         const four mid_a = a_chord * TURNED(on_a, a_cos, a_sin), mid_a2 = a_chord * TURNED(on_a2, a_cos, a_sin);
         const four mid_foot = b_chord * TURNED(on_foot, b_cos, b_sin), mid_b = b_chord * TURNED(on_b, b_cos, b_sin);
         const four mid_n = TURNED(n, b_cos, b_sin), mid_t = NORMAL_TO(mid_n);
         DISPLACEMENT(a, mid_a, on_a, moved)
         DISPLACEMENT(a, mid_a2, on_a2, moved2)
         DISPLACEMENT(b, mid_foot, on_foot, moved_foot)
         DISPLACEMENT(b, mid_b, on_b, moved_b)
         /* from the foot to the vertex, and from the point of b where the vertex was, at the end of the step */
         const four apart = gap_n + (moved - moved_foot), slid = moved2 - moved_b;
         const four across = n * TURN(t), shear45 = n * t, shear6 = 0.5 * (FIRST(across) + SECOND(across));
         e1 = b_cos * mid_n;
         const four e2 = NORMAL_TO(e1);
         const four a_back = TURNED(e1, a_full_cos, -a_full_sin), b_back = TURNED(e1, b_full_cos, -b_full_sin);
         const four a_back2 = NORMAL_TO(a_back), b_back2 = NORMAL_TO(b_back);
         ON_ARM(e1, a_back, mid_a, on_a, ea36, ea45)
         ON_ARM(e1, b_back, mid_foot, on_foot, ga36, ga45)
         ON_ARM(e2, a_back2, mid_a2, on_a2, eb36, eb45)
         ON_ARM(e2, b_back2, mid_b, on_b, gb36, gb45)
         const four turn_gap = 0.5 * b_chord * DOT(mid_t, apart + gap_n), turn_slip = 0.5 * b_chord * DOT(mid_n, slid);
         const four strain_gap = DOT(TURNED(t, b_full_cos, b_full_sin), apart);
         const four strain_slip = DOT(TURNED(n, b_full_cos, b_full_sin), slid);
         e136 = ea36, e145 = ea45, e236 = eb36, e245 = eb45;
         g136 = NEGATIVE(ga36) + PICK(turn_gap, NEGATIVE(strain_gap * shear6), 0, 5, 2, 7);
         g145 = NEGATIVE(ga45) - strain_gap * shear45;
         g236 = NEGATIVE(gb36) - PICK(turn_slip, NEGATIVE(strain_slip * shear6), 0, 5, 2, 7);
         g245 = NEGATIVE(gb45) + strain_slip * shear45;
      }
      /* to block a in the first half, to block b in the second */
      double *out = vectors + LINK_NUMBERS * c;
      if (share > 0 && share < 1)
      {
         e1 = 0.5 * (e1 - SWAP(e1));
         e136 = 0.5 * (e136 + SWAP(g136)), e145 = 0.5 * (e145 + SWAP(g145));
         e236 = 0.5 * (e236 + SWAP(g236)), e245 = 0.5 * (e245 + SWAP(g245));
      }
      else if (share <= 0)
      {
         e136 = PICK(e136, g136, 0, 1, 4, 5), e145 = PICK(e145, g145, 0, 1, 4, 5);
         e236 = PICK(e236, g236, 0, 1, 4, 5), e245 = PICK(e245, g245, 0, 1, 4, 5);
      }
      else
      {
         e1 = NEGATIVE(SWAP(e1));
         e136 = PICK(g136, e136, 2, 3, 6, 7), e145 = PICK(g145, e145, 2, 3, 6, 7);
         e236 = PICK(g236, e236, 2, 3, 6, 7), e245 = PICK(g245, e245, 2, 3, 6, 7);
      }
      memcpy(out, &e1, sizeof(four) / 2);
      const four line1 = PICK(e136, e145, 0, 4, 2, 6), rest1 = PICK(e145, e136, 1, 5, 3, 7);
      const four line2 = PICK(e236, e245, 0, 4, 2, 6), rest2 = PICK(e245, e236, 1, 5, 3, 7);
      PART(line1, out + 2, out + 10);
      PART(rest1, out + 4, out + 12);
      PART(line2, out + 6, out + 14);
      PART(rest2, out + 8, out + 16);
   }
}

/* Distance and slip of n contacts at the end of a step, seen from one block or as the mean of both views. */
FOR_EACH_PROCESSOR
void rockdda_contact_lengths(int n_rows, const int *rows, const int *block_a, const int *block_b, const double *point,
                             const double *distance, const double *normal, const double *shares, const double *lean,
                             const moved_block *moved, double *lengths)
{
   for (int l = 0; l < n_rows; ++l)
   {
      const long c = rows[l] - 1;
      const moved_block *a = moved + (block_a[c] - 1), *b = moved + (block_b[c] - 1);
      const double gap = distance[c], share = shares[c];
      const four n = REVERSE_SECOND(JOIN(normal + 2 * c, normal + 2 * c)), gap_n = gap * n;
      four p = JOIN(point + 2 * c, point + 2 * c), t = NORMAL_TO(n);
      if (share > 0 && share < 1)
         p += (0.5 * gap) * n;
      const four a_centroid = JOIN(a->centroid, b->centroid), b_centroid = SWAP(a_centroid);
      const four a_shift = JOIN(a->shift, b->shift), b_shift = SWAP(a_shift);
      const four a_h1 = JOIN(a->gradient, b->gradient), a_h2 = JOIN(a->gradient + 2, b->gradient + 2);
      const four b_h1 = SWAP(a_h1), b_h2 = SWAP(a_h2), on_a = p - a_centroid;
      const four beside = PLACE_OF_SLIP(c, n), on_a2 = beside - a_centroid, on_b = beside - b_centroid;
      const four on_foot = (p - gap_n) - b_centroid;
      t += TIMES(b_h1, b_h2, t);
      const four square = DOT(t, t);
      t /= TWICE(sqrt(square[0]), sqrt(square[2]));
      const four displaced = (a_shift + TIMES(a_h1, a_h2, on_a)) - b_shift;
      const four displaced2 = (a_shift + TIMES(a_h1, a_h2, on_a2)) - b_shift;
      const four x = (gap_n + displaced) - TIMES(b_h1, b_h2, on_foot), y = displaced2 - TIMES(b_h1, b_h2, on_b);
      const four across = TURN(t) * x, along = t * y;
      const four both = PICK(across, along, 0, 4, 2, 6) +
                        FLIP(PICK(across, along, 1, 5, 3, 7), ((mask){SIGN, 0, SIGN, 0}));
      const four result = share <= 0 ? both : share >= 1 ? SWAP(both) : 0.5 * (both + SWAP(both));
      memcpy(lengths + 2 * l, &result, sizeof(four) / 2);
   }
}

/* Distances and points of contacts first to last of the table, counted from 1, at the end of a step. A point between
 * two edges stays half-way between the two points of the blocks that it stood between. */
FOR_EACH_PROCESSOR
void rockdda_move_contacts(int first, int last, const int *block_a, const int *block_b, const signed char *station,
                           const double *normal, const double *shares, const double *gap_before, const double *gap,
                           const moved_block *moved, double *distance, double *point)
{
   for (long c = first - 1; c < last; ++c)
   {
      const double before = distance[c], share = shares[c];
      distance[c] = gap[c] + (before - gap_before[c]);
      /* a vertex has its place in the blocks */
      if (station[c] == 0)
         continue;
      const moved_block *a = moved + (block_a[c] - 1), *b = moved + (block_b[c] - 1);
      four p = JOIN(point + 2 * c, point + 2 * c);
      if (share > 0 && share < 1)
         p += REVERSE_SECOND((0.5 * before) * JOIN(normal + 2 * c, normal + 2 * c));
      const four arm = p - JOIN(a->centroid, b->centroid);
      const four h1 = JOIN(a->gradient, b->gradient), h2 = JOIN(a->gradient + 2, b->gradient + 2);
      const four end = (p + JOIN(a->shift, b->shift)) + TIMES(h1, h2, arm);
      const four result = share <= 0 ? end : share >= 1 ? SWAP(end) : 0.5 * (end + SWAP(end));
      memcpy(point + 2 * c, &result, sizeof(four) / 2);
   }
}

/* Forces of closed contacts first to last of the table, counted from 1, on the blocks of a range: their sums with
 * moments about the centroids, and the sums of their magnitudes. A vertex (station 0) has its place in the blocks; shear
 * forces act `lean` from the point. */
FOR_EACH_PROCESSOR
void rockdda_add_contact_forces(int first, int last, const int *range, const signed char *state,
                                const signed char *station, const int *vertex, const int *block_a, const int *block_b,
                                const double *normal_force, const double *shear_force, const double *normal,
                                const double *point, const double *lean, const double *vertices, const double *centroid,
                                double *resultant, double *magnitude)
{
   for (long c = first - 1; c < last; ++c)
   {
      const long a = block_a[c] - 1, b = block_b[c] - 1;
      const int on_a = a + 1 >= range[0] && a + 1 <= range[1], on_b = b + 1 >= range[0] && b + 1 <= range[1];
      if (state[c] == 0 || !(on_a || on_b))
         continue;
      const double *place = station[c] == 0 ? vertices + 2 * (long)(vertex[c] - 1) : point + 2 * c;
      const four n = REVERSE_SECOND(JOIN(normal + 2 * c, normal + 2 * c));
      const four shear = shear_force[c] * NORMAL_TO(n), force = normal_force[c] * n + shear;
      const four arm = JOIN(place, place) - JOIN(centroid + 2 * a, centroid + 2 * b);
      const four terms = arm * TURN(force) + JOIN(lean + 3 * c, lean + 3 * c) * TURN(shear);
      const four square = force * force;
      const double size = sqrt(square[0] + square[1]);
      if (on_a)
      {
         double *sum = resultant + 3 * a;
         sum[0] += force[0];
         sum[1] += force[1];
         sum[2] += terms[0] - terms[1];
         magnitude[a] += size;
      }
      if (on_b)
      {
         double *sum = resultant + 3 * b;
         sum[0] += force[2];
         sum[1] += force[3];
         sum[2] += terms[2] - terms[3];
         magnitude[b] += size;
      }
   }
}
