# SPDX-License-Identifier: MIT
"""Cases of contact by length with their truths; benchmarks/contact_by_length.py runs them."""
