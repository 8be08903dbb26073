"""The choice follows its row; when that is gone, nothing is chosen until a person moves."""

from formiga_bt.show.watch.selection import Selection


def test_the_choice_follows_its_id() -> None:
    chosen = Selection()
    chosen.see(["a", "b", "c"])
    chosen.choose(1)
    chosen.see(["c", "a", "x", "b"])
    assert (chosen.id, chosen.index) == ("b", 3)


def test_what_is_gone_is_not_replaced_by_its_neighbour() -> None:
    chosen = Selection()
    chosen.see(["a", "b", "c"])
    chosen.choose(1)
    chosen.see(["a", "c"])
    assert (chosen.id, chosen.gone, chosen.index) == ("", "b", 1)
    chosen.see(["a", "b", "c"])
    assert chosen.id == ""
    chosen.see(["a", "c"])
    chosen.move(1)
    assert (chosen.id, chosen.gone) == ("c", "")


def test_moving_stops_at_the_ends_and_without_rows() -> None:
    chosen = Selection()
    chosen.move(1)
    assert chosen.id == ""
    chosen.see(["a", "b"])
    chosen.choose(0)
    chosen.move(-3)
    assert chosen.id == "a"
    chosen.move(9)
    assert chosen.id == "b"
