"""Ctrl+C stops the work within 0.2 s, and other threads run on while it works."""

import signal
import threading
import time

import pytest

import sindyscope
from sindyscope import _native


@pytest.mark.parametrize("work", ["identify", "diagnose"])
def test_an_interrupt_stops_the_work(samples, work):
    files = {"identify": "friction_noisy.csv", "diagnose": "friction_noisy.csv"}
    pressed = []

    def press():
        # Once it is well at work.
        time.sleep(0.5)
        if _native.at_work():
            pressed.append(time.perf_counter())
            signal.raise_signal(signal.SIGINT)

    thread = threading.Thread(target=press)
    thread.start()
    try:
        with pytest.raises(KeyboardInterrupt):
            while True:
                getattr(sindyscope, work)(samples / files[work], test=samples / "friction_noisy_test.csv")
    finally:
        thread.join()
    heard = time.perf_counter() - pressed[0]
    while _native.at_work() and time.perf_counter() - pressed[0] < 5:
        time.sleep(0.002)
    ended = time.perf_counter() - pressed[0]
    print(f"{work}: heard after {1e3 * heard:.0f} ms, at rest after {1e3 * ended:.0f} ms")
    assert heard < 0.2
    assert ended < 1.0, "the work must hear of it too; with both cores busy it is late at times"


def test_the_interpreter_runs_on_while_it_works(samples):
    counted = 0
    done = threading.Event()

    def count():
        nonlocal counted
        while not done.is_set():
            counted += 1
            time.sleep(1e-3)

    thread = threading.Thread(target=count)
    thread.start()
    began = time.perf_counter()
    sindyscope.identify(samples / "friction_noisy.csv", test=samples / "friction_noisy_test.csv")
    seconds = time.perf_counter() - began
    done.set()
    thread.join()
    # A held lock would leave next to nothing; a busy machine takes its share.
    assert counted > 50 * seconds


def test_a_forked_process_works_on(samples):
    import multiprocessing

    sindyscope.identify(samples / "duffing.csv", window=31, order=5, threshold=0.02)
    if "fork" not in multiprocessing.get_all_start_methods():
        pytest.skip("no fork on this system")
    with multiprocessing.get_context("fork").Pool(1) as pool:
        job = pool.apply_async(_rmse, (str(samples / "duffing.csv"),))
        assert job.get(timeout=60) > 0


def _rmse(file):
    return sindyscope.identify(file, window=31, order=5, threshold=0.02).train["rmse"]
