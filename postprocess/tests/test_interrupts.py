# SPDX-License-Identifier: MIT
"""Ctrl-C while results are read and films are drawn."""

import os
import signal
import threading

import pytest
import rockdda
from rockdda.interrupts import HeldInterrupts
from synthetic import write_wall


def interrupt():
    os.kill(os.getpid(), signal.SIGINT)


@pytest.fixture(autouse=True)
def same_handler():
    """Every block gives the handler of the signal back."""
    before = signal.getsignal(signal.SIGINT)
    assert before is signal.default_int_handler
    yield
    after = signal.getsignal(signal.SIGINT)
    signal.signal(signal.SIGINT, before)
    assert after is before


def test_a_signal_waits_for_the_end_of_the_block():
    done = []
    with pytest.raises(KeyboardInterrupt), HeldInterrupts():
        interrupt()
        done.append("the rest of the block")
    assert done


def test_a_signal_waits_for_a_check():
    done = []
    with pytest.raises(KeyboardInterrupt), HeldInterrupts() as held:
        held.check()
        interrupt()
        done.append("before the check")
        held.check()
        done.append("after it")
    assert done == ["before the check"]


def test_a_signal_hides_the_error_that_it_causes():
    with pytest.raises(KeyboardInterrupt), HeldInterrupts():
        interrupt()
        raise BrokenPipeError


@pytest.mark.parametrize("depth", [1, 2, 3])
def test_a_second_signal_does_not_wait(depth):
    done = []

    def within(depth):
        with HeldInterrupts():
            if depth > 1:
                return within(depth - 1)
            interrupt()
            done.append("after the first")
            interrupt()
            done.append("after the second")

    with pytest.raises(KeyboardInterrupt):
        within(depth)
    assert done == ["after the first"]


def test_signals_around_and_within_a_block_within_another_count_together():
    done = []
    with pytest.raises(KeyboardInterrupt), HeldInterrupts():
        with HeldInterrupts():
            interrupt()
        done.append("after the first")
        with HeldInterrupts():
            interrupt()
        done.append("after the second")
    assert done == ["after the first"]


def test_other_handlers_get_the_signal():
    got = []
    signal.signal(signal.SIGINT, lambda number, _: got.append(number))
    with HeldInterrupts() as held:
        interrupt()
        assert got == []
        held.check()
        assert got == [signal.SIGINT]
    assert got == [signal.SIGINT]
    signal.signal(signal.SIGINT, signal.default_int_handler)


def test_ignored_signals_stay_ignored_and_other_threads_are_left_alone():
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    with HeldInterrupts():
        interrupt()
    signal.signal(signal.SIGINT, signal.default_int_handler)
    problems = []

    def work():
        try:
            with HeldInterrupts():
                pass
        except ValueError as error:  # signal.signal refuses in a thread
            problems.append(error)

    thread = threading.Thread(target=work)
    thread.start()
    thread.join()
    assert problems == []


def test_hdf5_is_not_interrupted(tmp_path):
    """HDF5 reads through functions of Python, in which an exception is lost or ends the process."""
    results = rockdda.open(write_wall(tmp_path / "wall.h5", 3, 2))
    done = []

    def work(file):
        interrupt()
        done.append(file["frames/time"][:].sum())

    with pytest.raises(KeyboardInterrupt):
        results._source.use(work)
    assert len(done) == 1
    assert len(results.times) == 3  # it can still be read


@pytest.mark.parametrize("name", ["film.mp4", "film.gif"])
@pytest.mark.parametrize("existing", [False, True])
def test_a_film_stops_between_two_frames(tmp_path, name, existing):
    results = rockdda.open(write_wall(tmp_path / "wall.h5", 3, 2, frames=20))
    if existing:
        (tmp_path / name).write_bytes(b"older film")
    done = []

    def progress(number, _):
        if number == 3:
            interrupt()
        done.append(number)

    with pytest.raises(KeyboardInterrupt):
        results.animate(tmp_path / name, dpi=30, progress=progress)
    assert done == [1, 2, 3]
    assert sorted(path.name for path in tmp_path.iterdir()) == ["film" + name[4:]] * existing + ["wall.h5"]
    assert not existing or (tmp_path / name).read_bytes() == b"older film"


def test_a_second_signal_ends_a_film_within_a_frame(tmp_path):
    results = rockdda.open(write_wall(tmp_path / "wall.h5", 3, 2, frames=20))
    done = []

    def progress(number, _):
        interrupt()
        interrupt()
        done.append(number)

    with pytest.raises(KeyboardInterrupt):
        results.animate(tmp_path / "film.mp4", dpi=30, progress=progress)
    assert done == []
    assert [path.name for path in tmp_path.iterdir()] == ["wall.h5"]
