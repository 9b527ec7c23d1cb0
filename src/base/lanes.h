/* SPDX-License-Identifier: MIT */
/* Vectors of four numbers of double precision. Processors with AVX compute them at once, others two by two: the compiler
 * makes a version of a procedure for each, of which the loader chooses one. Each entry is computed by the same operations
 * in the same order in all of them, so that the bits do not depend on the processor. */
#ifndef ROCKDDA_LANES_H
#define ROCKDDA_LANES_H
#include <stdint.h>

#if defined(__x86_64__) && defined(__gnu_linux__) && defined(__GNUC__) && !defined(__clang__)
#define FOR_EACH_PROCESSOR __attribute__((target_clones("avx", "default")))
#else
#define FOR_EACH_PROCESSOR
#endif

/* Fetch the line of memory some bytes behind p, which may be anywhere, before it is needed. It costs least where
 * the processor does not guess what is read next: blocks far from each other, and those of falling addresses. */
#if defined(__GNUC__)
#define SOON(p, bytes) __builtin_prefetch((const void *)((uintptr_t)(p) + (uintptr_t)(bytes)))
#else
#define SOON(p, bytes) ((void)0)
#endif

typedef double four __attribute__((vector_size(32)));

#endif
