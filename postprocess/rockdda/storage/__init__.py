# SPDX-License-Identifier: MIT
"""HDF5 files of results: reading while they grow, and checks of their structure and values."""
