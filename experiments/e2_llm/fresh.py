"""Fresh wordings of T6 to T10: ten of each, runs 30 to 39; and ten more (`fresh_again`), runs 40 to 49.

They were written last, by somebody who knew the oracles and not the drafting program, as different people in the field would
say it. They are for one measurement: what is changed after a look at how they went has no fresh wordings any more.
"""

from collections.abc import Mapping
from typing import Final

from experiments.e2_llm.fresh_again import AGAIN

FIRST: Final = 30
"""The first run that has a fresh wording."""
SECOND: Final = 40
"""The first run that has one of `fresh_again`."""

_FIRST_TEN: Final[Mapping[str, tuple[str, ...]]] = {
    "T6": (
        "Could one of the light drones have a look at things on every side of {center}? Once right round it, {radius} metres "
        "off, then over the middle of that ring, and after that home to its port, where it lands, please.",
        "LWD, single ship. Fly a 360 about {center} at {radius} m, overfly the centre point when the turn is complete, then "
        "RTB and land on its port.",
        "Somebody has lost a rucksack near {center}. Let a lightweight drone sweep a complete ring at {radius} metres' "
        "distance from there; next I want it above {center} itself, and finally it goes down on its home port.",
        "Light drone: full ring, centre {center}, R {radius} m. Close ring, cross centre, home port, down.",
        "For my course work I need one LWD to trace out a whole circle whose midpoint is {center} and whose radius is "
        "{radius_words} metres. When the circle is closed, it should go to the midpoint, and from there to its port to land.",
        "Please to make with one light drone the tour around {center}, always {radius} meters away of it, one time complete. "
        "After, it passes by the center on top and it returns to its port for the landing.",
        "A hedge runs in a perfect ring around {center}, {radius} m away from it. Get a light drone to follow the hedge the "
        "whole way, just the one time, and afterwards to cross over {center} before going back to its port and setting down.",
        "Before it lands back at its port, I'd like the light drone to drop by over {center}, and before that to have gone "
        "the whole way round that point at {radius_words} metres. Just the one drone.",
        "How does the ground look on all sides of {center}? Send out one light drone at a constant {radius} m from it, "
        "through all three hundred and sixty degrees, bring it in over the point itself, and take it home to its port to "
        "land.",
        "Job for a lightweight drone: starting wherever suits it, go the full way about {center} keeping {radius} metres "
        "off, end up on top of {center}, head for its own port, touch down.",
    ),
    "T7": (
        "I'd like three of the light drones hanging in the air at one moment: one over {corner}, and the other two {leg} "
        "metres from that one, so that it sits in a square corner between them. Once they all hang there, bring the lot down "
        "to the ground straight beneath.",
        "Three-ship, LWD. Lead holds above {corner}; wing one and wing two each hold {leg} m from lead with ninety degrees "
        "between their bearings. On all three steady: simultaneous vertical landing.",
        "To mark a landing zone I need three lightweight drones hovering at the corners of a right triangle. The square "
        "corner belongs over {corner} and either leg measures {leg} metres. They hold until the last one has arrived; then "
        "the three descend together and land under their positions.",
        "3 x light drone. Right-angle corner: {corner}. Legs: {leg} m, both. All hover, all hold for the others, then all "
        "land on the spot. Over.",
        "We want to show Pythagoras with LWDs, three of them. The vertex with the right angle is {corner}, the two sides "
        "that meet in it are {leg_words} metres long, and a drone hovers at every vertex. Only after every vertex is "
        "occupied may they land, all at once and vertically below.",
        "It is necessary three light drones for to do a triangle with one angle of ninety degrees. This angle is over "
        "{corner}; the two sides next to it have {leg} meters each. When the three are all stopped in the air on their "
        "points, they go down in the same time, each one on the ground under it.",
        "Draw me an L in the sky with three lightweight drones: the bend of the L above {corner}, each arm {leg} m, a drone "
        "at the bend and one at either tip. Hold the L until everybody is in it, then put them all on the ground directly "
        "below, together.",
        "Please let nobody touch the ground until the figure stands. The figure: a light drone above {corner}, a second "
        "{leg_words} metres off, and a third just as far off but turned by a quarter of a circle as seen from the first. "
        "After that, all three LWDs land at the same moment right where they hover.",
        "Surveying exercise: we station LWDs in the air over three points. Point A is {corner}; B and C are each {leg} m "
        "from A, with AB square to AC. As soon as A, B and C each have their drone overhead, all three set down at their own "
        "point simultaneously.",
        "Half a square, cut along its diagonal: that's the shape that I'd like to see three light drones hover in. Its right "
        "angle goes over {corner}, its equal sides are {leg} m. Everyone waits for everyone; next they all come down to land "
        "below themselves as one.",
    ),
    "T8": (
        "Have a light drone start above {start} and tack across the direct line to {end}, like a sailing boat against the "
        "wind. It sails {legs} straight stretches in all, reaching out {amplitude} metres on the one side and then on the "
        "other, and it is to land when it gets to {end}.",
        "Single LWD. Initial point {start}, final point {end}. Zigzag track of {legs} legs, turning points {amplitude} m off "
        "the centreline, left and right alternately. Full stop landing at the final point.",
        "The missing man walked from {start} to {end}, so search that way with one lightweight drone. First over {start}, "
        "next in {legs} straight runs that cross the route again and again, with the turns {amplitude} metres to its left "
        "and to its right by turns; at {end} it lands.",
        "Light drone. From: {start}. To: {end}. Zigzag, legs {legs}, offset {amplitude} m each side. Land at destination, "
        "stay there. Over.",
        "Imagine a straight string from {start} to {end}. An LWD begins over the first of these and flies along the string "
        "as a zigzag with the amplitude {amplitude_words} metres, which has {legs} segments altogether, and at the second it "
        "lands.",
        "One light drone goes at {start}. From there it makes zig-zag until {end}, this is {legs} straight pieces, and in "
        "each turn it is at {amplitude} meters from the line, one time left, other time right. In {end} it does the landing "
        "and finish.",
        "Please don't go straight between {start} and {end}: with a lightweight drone, zigzag instead. Go {amplitude} m out "
        "to one side, the same to the other, until {legs} legs are done, and put down right on {end}. It should of course "
        "pass over {start} to begin.",
        "Land a light drone at {end}, but let it come there from {start} on a crooked course: a zigzag made of {legs_words} "
        "legs whose bends lie {amplitude_words} metres from the straight connection, changing sides every time.",
        "Our crop stands in a strip along the line that leads from {start} to {end}, and the strip reaches {amplitude} "
        "metres to both sides of it. Make an LWD bounce from edge to edge of the strip in {legs} straight legs, first "
        "overhead {start}, last touching down at {end}.",
        "Zigzag run for one lightweight drone, {legs} legs, peak deviation {amplitude} m on alternate sides. It sets off "
        "above {start}; {end} is where it ends, and that is where the drone has to be on the ground.",
    ),
    "T9": (
        "I want a light drone put down at {target}. While that goes on, another light drone keeps an eye on things: one "
        "whole turn around {target}, {radius} metres out. It needn't wait for the first one, and goes back to its port to "
        "land when the turn is done.",
        "Two LWDs, simultaneous departure. Number one: direct {target}, land. Number two: one 360 around {target}, radius "
        "{radius} m, then own landing at home port, no coordination with number one required.",
        "A casualty may be at {target}. Drone one, a lightweight, lands there with the radio; drone two, also lightweight, "
        "does a complete circuit of the place meanwhile, keeping {radius} metres from it, after which it returns to its own "
        "port and lands without regard to the other.",
        "Two light drones, same time. One lands {target}. Two goes full ring about {target}, radius {radius} m, lands where "
        "ring ends, independent. Out.",
        "We need two LWDs that work in parallel. The escort sets itself down at {target}, and the guard describes a full "
        "circle with the radius {radius_words} metres and {target} as its centre. As soon as the circle is closed, the guard "
        "lands at its port, no matter whether the escort is down already.",
        "Two light drones must fly in the same moment. The one goes to {target} and makes landing there. The other turns "
        "around this place one complete time with distance of {radius} meters, and then he lands alone, in his port, he does "
        "not wait.",
        "Please guard the landing of a lightweight drone at {target}: during it, have one more lightweight drone go all the "
        "way about the landing place, once, {radius} m from it. The guard lands as soon as it has finished, on its own, a "
        "few metres outside its ring.",
        "Around {target} goes one of two LWDs, for just a single lap, at {radius_words} metres. The other of the two comes "
        "down at {target} during that time. The one that did the lap touches down by itself afterwards, at the spot where it "
        "completed it.",
        "Fly a pair of light drones together. I'm waiting at {target} and one of them should land here; its partner should "
        "watch over it from {radius} m off, making one closed turn about the place, and land at its own port whenever it is "
        "through.",
        "Show of two lightweight drones, both flying at once. The soloist touches down on {target}; the companion orbits "
        "that point a single time, {radius} metres away all along, and lands for itself somewhere just outside that orbit.",
    ),
    "T10": (
        "Two light drones carry the crates over to {target}. Let them land with {spacing} metres from one to the other. Then "
        "ask a watcher whether everything is unloaded; if they say yes, the first goes back to its port and lands, and the "
        "second carries on to {next} and lands.",
        "Two-ship LWD, destination {target}, touchdown points {spacing} m apart. When both are on deck: request clearance "
        "from a watcher. If affirmative, lead recovers to its home port, wing departs for {next}, full stop there.",
        "We supply the search party at {target} by two lightweight drones. They are to stand {spacing} metres from one "
        "another after landing, and nobody moves until a watcher has been asked and has said yes. Given that, the first of "
        "them flies to its port to land; the second is needed at {next}, where it lands.",
        "Light drones, two. Land {target}, gap {spacing} m. Query watcher. Yes: one to home port, land; two to {next}, land. "
        "No: nobody moves. Over.",
        "In our experiment two LWDs touch down at {target} so that the distance between them is {spacing_words} metres. When "
        "both are on the ground, a watcher has to answer whether the unloading is finished. If it is, number one heads home "
        "to land at its port, whereas number two flies to {next}, landing there too.",
        "I need that two light drones are landing in {target}, between them {spacing} meters of space. Then we ask to the "
        "watcher if it is all ok. If he tells yes, the drone one comes back at his port and lands, the drone two goes until "
        "{next} and lands also.",
        "In the end, I want the first of two lightweight drones standing at its port again and the second standing at "
        "{next}. Before that both have to call at {target}, sit down {spacing} m away from each other, and ask a watcher for "
        "permission to leave; without a yes they don't go.",
        "Would you kindly drop in at {target} with two LWDs and park them {spacing_words} metres apart? A watcher is then "
        "going to check the load, so please ask them. If they confirm, let the first drone return and land at its port and "
        "the second one travel on to {next}, where it comes down.",
        "Bring two light drones down at {target} for loading, leaving {spacing} m of room between the two. Put the question "
        "to a watcher once they're both down. A yes sends the first to its own port and the second off to {next}; wherever "
        "they go, they land.",
        "Berries are waiting at {target}. A couple of lightweight drones land there, {spacing} metres one from the other, "
        "and get loaded; ask a watcher whether that's done. If so, drone 1 takes its share to its port and drone 2 takes its "
        "own to {next}, each of them landing.",
    ),
}  # fmt: skip
FRESH: Final[Mapping[str, tuple[str, ...]]] = {task: (*first, *AGAIN[task]) for task, first in _FIRST_TEN.items()}
"""The wordings of runs 30, 31, ...; `{radius_words}` is the radius in words."""

_IN_WORDS: Final = {
    "3": "three", "5": "five", "6": "six", "8": "eight", "10": "ten", "12": "twelve", "15": "fifteen", "20": "twenty",
    "30": "thirty",
}  # fmt: skip


def in_words(told: Mapping[str, str]) -> dict[str, str]:
    """Return what a request tells, and each number of it in words beside it: `radius_words` of `radius`."""
    return {**told, **{f"{name}_words": _IN_WORDS[value] for name, value in told.items() if value in _IN_WORDS}}
