# SPDX-License-Identifier: MIT
"""Analysis of results and closed-form methods: comparison of runs, loosening, voussoir beams, rock loads."""
