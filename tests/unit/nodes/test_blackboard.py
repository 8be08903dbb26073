"""The blackboard: versions, readers, and what is shown to others."""

from formiga_bt.nodes.blackboard import Blackboard

FIRST, SECOND = ("T-1", "steps[0]"), ("T-2", "steps[0]")


def test_a_write_that_changes_nothing_is_no_change() -> None:
    board = Blackboard()

    assert board.put("/a", 1)
    assert not board.put("/a", 1)
    assert board.put("/a", 2)
    assert (board.get("/a"), board.version("/a")) == (2, 2)


def test_a_key_never_written_has_the_default_and_version_zero() -> None:
    board = Blackboard()

    assert (board.get("/a"), board.get("/a", 5), board.version("/a")) == (None, 5, 0)


def test_readers_of_a_changed_key_are_told_once_in_the_order_of_the_writes() -> None:
    board = Blackboard()
    board.watch("/b", SECOND)
    board.watch("/a", FIRST)
    board.watch("/a", SECOND)

    board.put("/b", 1)
    board.put("/a", 1)
    board.put("/a", 1)

    assert board.take_hits() == (SECOND, FIRST)
    assert board.take_hits() == ()


def test_who_unwatched_is_not_told() -> None:
    board = Blackboard()
    board.watch("/a", FIRST)
    board.unwatch("/a", FIRST)
    board.unwatch("/never", FIRST)

    board.put("/a", 1)

    assert board.take_hits() == ()


def test_keys_below_a_prefix_come_in_the_order_of_first_writing() -> None:
    board = Blackboard()
    for key in ("/t/b", "/u/x", "/t/a", "/t/b"):
        board.put(key, key)

    assert [key for key, _ in board.under("/t/")] == ["/t/b", "/t/a"]
    board.drop("/t/b")
    board.drop("/t/b")
    assert [key for key, _ in board.under("/t/")] == ["/t/a"]


def test_who_listens_to_a_branch_hears_each_key_below_it_that_changes_once() -> None:
    board = Blackboard()
    heard = board.listen("/fleet/", "/orders/")
    board.put("/fleet/hwd/hwd_1/battery", 1)
    board.put("/fleet/hwd/hwd_1/battery", 1)
    board.put("/fleet/hwd/hwd_1/battery", 2)
    board.put("/tasks/T-1/status", "ACTIVE")
    board.touch("/orders/hwd_1")
    board.drop("/fleet/never")

    assert list(heard) == ["/fleet/hwd/hwd_1/battery", "/orders/hwd_1"]
    heard.clear()
    board.drop("/fleet/hwd/hwd_1/battery")
    assert list(heard) == ["/fleet/hwd/hwd_1/battery"]
