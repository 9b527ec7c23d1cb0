# SPDX-License-Identifier: MIT
"""Random models that nobody tuned, judged by answers that do not come from this program.

`scripts/campaign` draws, judges and shrinks them; `test_campaign.py` runs a sample. Each module but `bench`, `drawing`,
`limits` and `records` holds the kinds of one family.
"""
