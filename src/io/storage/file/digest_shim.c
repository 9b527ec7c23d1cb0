/* SPDX-License-Identifier: MIT */
/* SHA-256 (FIPS 180-4) of bytes and of files. */
#define _POSIX_C_SOURCE 200809L
#include <errno.h>
#include <stdint.h>
#include <stdio.h>
#include <string.h>
#if defined(__x86_64__) && defined(__GNUC__)
#define WITH_INSTRUCTIONS
#include <cpuid.h>
#include <immintrin.h>
#endif

/* Take n blocks of 64 bytes. */
typedef void take_blocks_t(uint32_t *state, const unsigned char *block, size_t n);

typedef struct {
   uint32_t state[8];
   uint64_t length; /* bytes taken */
   unsigned char block[64];
   take_blocks_t *take_blocks;
} sha256_t;

static const uint32_t start_state[8] = { 0x6a09e667, 0xbb67ae85, 0x3c6ef372, 0xa54ff53a,
                                         0x510e527f, 0x9b05688c, 0x1f83d9ab, 0x5be0cd19 };

static const uint32_t round_constants[64] = {
   0x428a2f98, 0x71374491, 0xb5c0fbcf, 0xe9b5dba5, 0x3956c25b, 0x59f111f1, 0x923f82a4, 0xab1c5ed5,
   0xd807aa98, 0x12835b01, 0x243185be, 0x550c7dc3, 0x72be5d74, 0x80deb1fe, 0x9bdc06a7, 0xc19bf174,
   0xe49b69c1, 0xefbe4786, 0x0fc19dc6, 0x240ca1cc, 0x2de92c6f, 0x4a7484aa, 0x5cb0a9dc, 0x76f988da,
   0x983e5152, 0xa831c66d, 0xb00327c8, 0xbf597fc7, 0xc6e00bf3, 0xd5a79147, 0x06ca6351, 0x14292967,
   0x27b70a85, 0x2e1b2138, 0x4d2c6dfc, 0x53380d13, 0x650a7354, 0x766a0abb, 0x81c2c92e, 0x92722c85,
   0xa2bfe8a1, 0xa81a664b, 0xc24b8b70, 0xc76c51a3, 0xd192e819, 0xd6990624, 0xf40e3585, 0x106aa070,
   0x19a4c116, 0x1e376c08, 0x2748774c, 0x34b0bcb5, 0x391c0cb3, 0x4ed8aa4a, 0x5b9cca4f, 0x682e6ff3,
   0x748f82ee, 0x78a5636f, 0x84c87814, 0x8cc70208, 0x90befffa, 0xa4506ceb, 0xbef9a3f7, 0xc67178f2 };

static uint32_t turn(uint32_t x, int n)
{
   return x >> n | x << (32 - n);
}

static void take_block(uint32_t *state, const unsigned char *block)
{
   uint32_t w[64], s[8], t1, t2;
   int i;
   for (i = 0; i < 16; i++)
      w[i] = (uint32_t)block[4 * i] << 24 | (uint32_t)block[4 * i + 1] << 16 | (uint32_t)block[4 * i + 2] << 8 |
             block[4 * i + 3];
   for (; i < 64; i++)
      w[i] = w[i - 16] + (turn(w[i - 15], 7) ^ turn(w[i - 15], 18) ^ w[i - 15] >> 3) + w[i - 7] +
             (turn(w[i - 2], 17) ^ turn(w[i - 2], 19) ^ w[i - 2] >> 10);
   memcpy(s, state, sizeof s);
   for (i = 0; i < 64; i++) {
      t1 = s[7] + (turn(s[4], 6) ^ turn(s[4], 11) ^ turn(s[4], 25)) + ((s[4] & s[5]) ^ (~s[4] & s[6])) +
           round_constants[i] + w[i];
      t2 = (turn(s[0], 2) ^ turn(s[0], 13) ^ turn(s[0], 22)) + ((s[0] & s[1]) ^ (s[0] & s[2]) ^ (s[1] & s[2]));
      memmove(s + 1, s, 7 * sizeof *s);
      s[4] += t1;
      s[0] = t1 + t2;
   }
   for (i = 0; i < 8; i++) state[i] += s[i];
}

static void take_portable(uint32_t *state, const unsigned char *block, size_t n)
{
   for (; n > 0; n--, block += 64) take_block(state, block);
}

#ifdef WITH_INSTRUCTIONS
/* The same with the processor's instructions for SHA-256. They keep the state as the vectors (f, e, b, a) and
 * (h, g, d, c), lowest first; each of them does two rounds, four words of the schedule serve four rounds. */
__attribute__((target("sha,sse4.1,ssse3"))) static void take_instructed(uint32_t *state, const unsigned char *block,
                                                                        size_t n)
{
   const __m128i order = _mm_set_epi64x(0x0c0d0e0f08090a0b, 0x0405060700010203); /* big endian words */
   __m128i abcd = _mm_loadu_si128((const __m128i *)state), efgh = _mm_loadu_si128((const __m128i *)(state + 4));
   __m128i cdab = _mm_shuffle_epi32(abcd, 0xb1), hgfe = _mm_shuffle_epi32(efgh, 0x1b);
   __m128i abef = _mm_alignr_epi8(cdab, hgfe, 8), cdgh = _mm_blend_epi16(hgfe, cdab, 0xf0);
   for (; n > 0; n--, block += 64) {
      const __m128i abef_before = abef, cdgh_before = cdgh;
      __m128i w[4], sum, next;
      int i;
      for (i = 0; i < 4; i++)
         w[i] = _mm_shuffle_epi8(_mm_loadu_si128((const __m128i *)(block + 16 * i)), order);
#pragma GCC unroll 16
      for (i = 0; i < 16; i++) { /* rounds 4 i to 4 i + 3 */
         sum = _mm_add_epi32(w[i % 4], _mm_loadu_si128((const __m128i *)(round_constants + 4 * i)));
         cdgh = _mm_sha256rnds2_epu32(cdgh, abef, sum);
         abef = _mm_sha256rnds2_epu32(abef, cdgh, _mm_shuffle_epi32(sum, 0x0e));
         if (i < 12) { /* words 4 i + 16 to 4 i + 19 */
            next = _mm_sha256msg1_epu32(w[i % 4], w[(i + 1) % 4]);
            next = _mm_add_epi32(next, _mm_alignr_epi8(w[(i + 3) % 4], w[(i + 2) % 4], 4));
            w[i % 4] = _mm_sha256msg2_epu32(next, w[(i + 3) % 4]);
         }
      }
      abef = _mm_add_epi32(abef, abef_before);
      cdgh = _mm_add_epi32(cdgh, cdgh_before);
   }
   cdab = _mm_shuffle_epi32(abef, 0x1b);
   hgfe = _mm_shuffle_epi32(cdgh, 0xb1);
   _mm_storeu_si128((__m128i *)state, _mm_blend_epi16(cdab, hgfe, 0xf0));
   _mm_storeu_si128((__m128i *)(state + 4), _mm_alignr_epi8(hgfe, cdab, 8));
}

static int has_instructions(void)
{
   unsigned a, b, c, d;
   if (!__get_cpuid(1, &a, &b, &c, &d) || !(c & bit_SSSE3) || !(c & bit_SSE4_1)) return 0;
   return __get_cpuid_count(7, 0, &a, &b, &c, &d) && (b & bit_SHA);
}
#endif

static void start(sha256_t *sha, int portable)
{
   memcpy(sha->state, start_state, sizeof start_state);
   sha->length = 0;
   sha->take_blocks = take_portable;
#ifdef WITH_INSTRUCTIONS
   if (!portable && has_instructions()) sha->take_blocks = take_instructed;
#else
   (void)portable;
#endif
}

static void take(sha256_t *sha, const unsigned char *bytes, size_t n)
{
   size_t used = (size_t)(sha->length % 64), part;
   sha->length += n;
   if (used > 0) { /* fill the block that was begun */
      part = 64 - used < n ? 64 - used : n;
      memcpy(sha->block + used, bytes, part);
      bytes += part;
      n -= part;
      if (used + part < 64) return;
      sha->take_blocks(sha->state, sha->block, 1);
   }
   sha->take_blocks(sha->state, bytes, n / 64);
   memcpy(sha->block, bytes + n - n % 64, n % 64);
}

static void finish(sha256_t *sha, unsigned char *digest)
{
   static const unsigned char padding[64] = { 0x80 };
   uint64_t bits = 8 * sha->length;
   unsigned char end[8];
   int i;
   take(sha, padding, 1 + (size_t)((119 - sha->length % 64) % 64));
   for (i = 0; i < 8; i++) end[i] = (unsigned char)(bits >> (56 - 8 * i));
   take(sha, end, 8);
   for (i = 0; i < 32; i++) digest[i] = (unsigned char)(sha->state[i / 4] >> (24 - 8 * (i % 4)));
}

/* Checksum of a growing list, updated once per value, so that it does not depend on the number of values per call. A
 * changed value always changes the sum. */
static uint64_t fold(uint64_t sum, uint64_t value)
{
   sum = (sum ^ value) * 0x9e3779b97f4a7c15u;
   return sum ^ (sum >> 29);
}

int64_t rockdda_fold_reals(int64_t sum, const double *values, long long n)
{
   uint64_t result = (uint64_t)sum, bits;
   long long i;
   for (i = 0; i < n; i++) {
      memcpy(&bits, values + i, sizeof bits);
      result = fold(result, bits);
   }
   return (int64_t)result;
}

int64_t rockdda_fold_integers(int64_t sum, const int32_t *values, long long n)
{
   uint64_t result = (uint64_t)sum;
   long long i;
   for (i = 0; i < n; i++) result = fold(result, (uint32_t)values[i]);
   return (int64_t)result;
}

/* Digest of bytes in memory; portable: without special instructions, for tests. */
void rockdda_sha256_bytes(const unsigned char *bytes, long long n, int portable, unsigned char *digest)
{
   sha256_t sha;
   start(&sha, portable);
   take(&sha, bytes, (size_t)n);
   finish(&sha, digest);
}

/* Digest of the first n bytes of a file, of all of it when n < 0. 0 or an errno value. */
int rockdda_sha256_file(const char *path, long long n, unsigned char *digest)
{
   unsigned char buffer[65536];
   sha256_t sha;
   int problem = 0;
   FILE *file = fopen(path, "rb");
   if (!file) return errno;
   start(&sha, 0);
   while (n != 0) {
      size_t wanted = n < 0 || n > (long long)sizeof buffer ? sizeof buffer : (size_t)n;
      size_t got = fread(buffer, 1, wanted, file);
      take(&sha, buffer, got);
      if (n > 0) n -= (long long)got;
      if (got < wanted) break;
   }
   if (ferror(file)) problem = EIO;
   fclose(file);
   finish(&sha, digest);
   return problem;
}
