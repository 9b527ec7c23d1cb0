# SPDX-License-Identifier: MIT
"""Cases that agree, break a promise, fail and crash, without running anything."""

import math
import os

import pandas
from rockdda_validation import Case


def agrees(record):
    from matplotlib import pyplot as plt

    record.text("Words with *stress*, `code` and a <tag>.\n\n## A heading\n\n- one\n- two")
    record.compare("slip", 1.001, "m", truth=1.0, truth_source="closed form", allowed=0.01)
    record.compare("thrust", 2.0, "kN", truth=2.0, truth_source="statics", published=3.0, published_source="Table 9.9")
    record.compare("bounded", 1.0, "m", truth=0.5, scale=1, allowed=1.0, published=4.0, bound="upper")
    record.compare("told", math.nan, published=1.0, explanation="nothing is known | nothing at all")
    record.table(pandas.DataFrame({"n": range(50), "x": [0.5] * 49 + [math.nan]}), "rows", "Fifty rows.")
    with record.style():
        figure, axes = plt.subplots(figsize=(2, 2))
        axes.plot([0, 1], [0, 1])
        record.figure(figure, "line", "A line.")


def differs(record):
    record.text("Here" + (" all" if record.full else " some") + ".")
    record.compare("angle", 12.0, "°", truth=10.0, truth_source="statics", allowed=0.1, explanation="it is wrong")
    record.compare("zero", 0.5, "m", truth=0.0, scale=1, allowed=1.0)


def fails(record):
    record.compare("before", 1.0, truth=1.0, allowed=0.1)
    raise ValueError(f"no such thing in {record.folder / 'run'}")


def crashes(record):
    os._exit(7)


CASES = [
    Case("9.1-agrees", "One that agrees", "Chapter 4", agrees),
    Case("9.2-differs", "One that differs", "Chapter 4", differs),
    Case("9.3-fails", "One that fails", "Closed forms", fails),
    Case("9.4-crashes", "One that crashes", "Closed forms", crashes, quick=False),
]
