# SPDX-License-Identifier: MIT
"""SciPy's sparse direct solver (SuperLU) on the matrix of a real step, for comparison."""

from __future__ import annotations

import os
import time
from pathlib import Path

import numpy as np
from scipy.sparse import bsr_matrix, csc_matrix
from scipy.sparse.linalg import splu


def read_matrix(path: Path) -> tuple[csc_matrix, np.ndarray, np.ndarray]:
    """K, f, x of a file that bench_steps wrote."""
    data = path.read_bytes()
    n, stored = np.frombuffer(data, np.int32, 2)
    start = np.frombuffer(data, np.int32, n + 1, 8) - 1
    column = np.frombuffer(data, np.int32, stored, 8 + 4 * (n + 1)) - 1
    at = 8 + 4 * (n + 1 + stored)
    values = np.frombuffer(data, np.float64, 36 * stored, at).reshape(stored, 6, 6).transpose(0, 2, 1)
    at += 8 * 36 * stored
    f, x = np.frombuffer(data, np.float64, 12 * n, at).reshape(2, 6 * n)
    upper = bsr_matrix((values, column, start), shape=(6 * n, 6 * n))
    diagonal = bsr_matrix((values[start[:-1]], np.arange(n), np.arange(n + 1)), shape=(6 * n, 6 * n))
    return csc_matrix(upper + upper.T - diagonal), f, x


def solve_with_scipy(path: Path) -> dict:
    """Seconds of processor time to factorise and solve, entries of the factors, difference from the file's solution."""
    matrix, f, x = read_matrix(path)
    begun = time.process_time()
    factor = splu(matrix, permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options={"SymmetricMode": True})
    factorised = time.process_time()
    solution = factor.solve(f)
    solved = time.process_time()
    return {
        "unknowns": int(f.size),
        "seconds": solved - begun,
        "factor_seconds": factorised - begun,
        "solve_seconds": solved - factorised,
        "entries": int(factor.L.nnz + factor.U.nnz),
        "difference": float(np.linalg.norm(solution - x) / np.linalg.norm(x)),
        "residual": float(np.linalg.norm(matrix @ x - f) / np.linalg.norm(f)),
        "blas_threads": int(os.environ.get("OPENBLAS_NUM_THREADS", "0")),
    }
