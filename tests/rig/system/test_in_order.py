"""Work on all cores: results in turn, and nothing begun after an error."""

import threading

import pytest

from rig.system.in_order import in_order


def test_results_come_in_turn_and_an_error_ends_the_rest():
    begun = []

    def work(number):
        begun.append(number)
        if number == 5:
            raise OSError("the sixth")
        return 2 * number

    found = in_order(work, range(1000), 3)
    assert [next(found) for _ in range(5)] == [0, 2, 4, 6, 8]
    with pytest.raises(OSError, match="the sixth"):
        next(found)
    assert len(begun) < 20


def test_items_are_made_in_the_thread_that_takes_the_results():
    def made():
        for number in range(20):
            yield number, threading.get_ident()

    found = list(in_order(lambda item: (*item, threading.get_ident()), made(), 3))
    assert [number for number, _, _ in found] == list(range(20))
    assert {maker for _, maker, _ in found} == {threading.get_ident()}
    assert threading.get_ident() not in {worker for _, _, worker in found}
