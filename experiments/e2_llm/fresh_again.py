"""Fresh wordings of T6 to T10 once more: ten of each, runs 40 to 49.

They were written after the others (`fresh`) had been looked at, by somebody who knew what the tasks want, and no file of
the project.
"""

from collections.abc import Mapping
from typing import Final

AGAIN: Final[Mapping[str, tuple[str, ...]]] = {
    "T6": (
        "Something has been at my bushes near {center}. Could one light drone go all the way round the spot once, "
        "{radius} metres out, then come in right over the middle, and after that fly home and land on its port?",
        "Single LWD, one full orbit of {center}, radius {radius_words} metres. Orbit complete, proceed overhead {center} "
        "itself, then return to home port and land.",
        "My pupils are learning about circles. Please have one of the light drones draw one whole circle of radius "
        "{radius} m in the air with its centre at {center}, then move to the centre point itself, and finally go back to "
        "its port and land.",
        "Send one lightweight drone to {center}. I want the perimeter first: one complete lap at {radius_words} metres "
        "from the point. Then a look from straight above the point. Then bring it home to land at its own port.",
        "Take {center} as the centre and {radius} m as the radius. One light drone flies the full circumference once, "
        "closing the circle, then positions itself above the centre, then returns to its port to land.",
        "Hello, I need one light drone for my group. It flies around {center} one time, whole circle, distance "
        "{radius_words} metres from the middle. After circle it comes above the middle. Then it flies home and lands in "
        "its own port.",
        "can one of the light drones do a full loop around {center}, like {radius} m away from it the whole time, just "
        "once, then fly over the actual spot and then go land back at its home port",
        "The shot ends with the drone landing at its home port. Before that it passes over {center} itself, and it opens "
        "with one unbroken circle round that same point at {radius} metres. One light drone, nothing else.",
        "It is requested that one lightweight drone make a single complete circuit of {center} at a distance of "
        "{radius_words} metres, thereafter proceed to a position directly above that place, and thereupon return to its "
        "home port and land there.",
        "1 LWD: circle {center} at {radius} m, one full turn. Then over the centre. Then home, land at its port.",
    ),
    "T7": (
        "I want to mark out a square corner for the new field at {corner}. One light drone hovers over that corner, two "
        "more each hover {leg} metres from it, at right angles. When all three are hanging there together, they all land "
        "straight down at the same time.",
        "Three LWDs, right-triangle formation. Lead holds over {corner}, the other two hold {leg_words} metres from lead "
        "with ninety degrees between them. Nobody lands until all three are in the hover. Then all three land together, "
        "on the spot.",
        "For our geometry lesson, please let three light drones hover as the corners of a right triangle. The right angle"
        " sits over {corner} and both short sides are {leg} m long. Only once all three are hovering may they land, "
        "together, each right below itself.",
        "I need three light drones down on the ground at the same time: one at {corner}, the other two each {leg_words} "
        "metres from that one, in directions at right angles. First all three hover above their spots together; no early "
        "landings.",
        "Set out a right angle with three lightweight drones: vertex over {corner}, two equal legs of {leg} m each, one "
        "drone at the end of each leg. All three hover in place at once, then descend simultaneously and land at those "
        "points.",
        "Please use three light drones. One stay in the air above {corner}. Two others stay in the air {leg_words} metres"
        " from the first one, so they make ninety degree corner. Wait until all three are ready in the air, then they "
        "land together, each one straight down.",
        "get 3 light drones hovering in a right angled triangle, one above {corner} where the right angle is and the "
        "other two each {leg} m away from that one. once theyre all up there at the same time they all land together "
        "right where they are",
        "Picture three light drones frozen in the air: one over {corner}, another {leg} metres from the first, the last "
        "one also {leg} metres from the first but at a right angle. Hold until all three are in frame hovering, then they"
        " touch down together, straight below.",
        "Three lightweight drones shall simultaneously hover so as to form a right triangle, the right angle being above "
        "{corner} and each of the two adjoining sides measuring {leg_words} metres. None shall land before this is "
        "achieved; all three shall then land together where they are.",
        "3 LWDs, right triangle: one over {corner}, two at {leg} m from it, 90 degrees. All hovering at once, no one "
        "lands before, then all three land together below where they hover.",
    ),
    "T8": (
        "Scare the birds off the rows for me: one light drone starts over {start} and zigzags across to {end}, {legs} "
        "stretches in all, swinging {amplitude} metres out to one side of the straight line and then the other. It can "
        "land at {end}.",
        "One LWD, zigzag run. Start point overhead {start}, finish {end}, {legs_words} legs, turning points "
        "{amplitude_words} metres off the direct track, alternating left and right. Land at the finish point.",
        "Please let one light drone fly a zigzag made of {legs} straight pieces. It begins above {start} and finishes by "
        "landing at {end}. At each bend it is {amplitude} m away from the straight line between the two, first on one "
        "side, then on the other.",
        "We are searching the strip from {start} to {end}. One light drone, beginning over the first, weaving in "
        "{legs_words} legs with turns {amplitude} metres either side of the straight line, alternately. It lands when it "
        "gets to {end}.",
        "Baseline runs from {start} to {end}. One lightweight drone begins over the first point, flies a zigzag of {legs}"
        " legs with vertices offset {amplitude_words} metres from the baseline on alternating sides, and lands at the "
        "second point.",
        "For my guests I would like that one light drone starts the show over {start} and flies from there in zigzag to "
        "{end}, with {legs_words} legs. It shall turn each time {amplitude_words} metres beside the straight line, always"
        " changing the side, and at {end} it lands.",
        "one light drone pls, go over {start} first then zigzag to {end} in {legs} legs, the turns should be {amplitude} "
        "m out from the straight line, left right left right and so on. then land at {end}",
        "The light drone lands at {end}, that is our last frame. It gets there from above {start}, slaloming: "
        "{legs_words} straight legs, each turn {amplitude} metres off the direct line, swapping sides every time. Only "
        "one drone in this.",
        "One lightweight drone is to commence above {start} and proceed to {end} along a zigzag course consisting of "
        "{legs} legs, each change of direction lying {amplitude} metres from the straight line, on alternate sides. The "
        "drone is to land at {end}.",
        "Zigzag, 1 LWD, from over {start} to {end}: {legs} legs, turns {amplitude} m off the line, alternating sides, "
        "land at the end.",
    ),
    "T9": (
        "I need two light drones up together. One sets down at {target}. While it is doing that, the other goes once all "
        "the way round {target}, {radius} metres out, and then just goes back to its own port and lands without waiting "
        "for the first.",
        "Two LWDs airborne at the same time. Number one lands at {target}. Number two meanwhile flies one full orbit of "
        "{target} at {radius_words} metres, then lands at own home port independently. Number two does not hold for "
        "number one.",
        "Could two light drones be flying at the same time, please? One comes down and lands at {target}, and in the "
        "meantime the other makes one whole circle of radius {radius} m around it. When its circle is finished, that one "
        "flies to its own port and lands, whatever the first is doing.",
        "Two light drones at {target}, both in the air together. First one goes in and lands there; second one covers it "
        "with one complete lap at {radius_words} metres. Lap done, the second lands a few metres outside its circle, "
        "without waiting for the first.",
        "With two lightweight drones flying simultaneously: unit A lands at {target}; during this, unit B flies one "
        "closed circle of radius {radius} m centred on {target}, then lands a few metres outside the circle. B is not to "
        "wait for A.",
        "I would like two light drones, both in air same time. One lands at {target}. During that the other one flies "
        "around {target} one full round, {radius_words} metres away from it, and after its round it goes to own home port"
        " and lands. It does not need to wait the first one.",
        "so two light drones in the air at once, one lands at {target} and while thats happening the other one does one "
        "full circle round {target}, {radius} m out. when its done circling it goes home and lands at its port, doesnt "
        "have to wait for the other one",
        "Drone B draws one full ring around {target} at {radius_words} metres while drone A comes down in the middle and "
        "lands there. Both light drones, both airborne at the same time. B then lands on its own, a few metres outside "
        "the ring, not waiting on A.",
        "Two lightweight drones shall be airborne concurrently. One shall land at {target}. The other shall meanwhile "
        "complete a single circuit of {target} at a distance of {radius} metres and shall then land at its own home port "
        "without awaiting the first.",
        "2 LWDs up at once. One lands at {target}, the other does one full circle round it at {radius} m meanwhile, then "
        "lands at its own port. No waiting for each other.",
    ),
    "T10": (
        "Land two light drones at {target}, {spacing} metres from each other. Then ask a watcher whether the pickers are "
        "done there. If the answer is yes, the first one flies home to its port and lands, and the second goes on to land"
        " at {next}. If no, leave both where they are.",
        "Two LWDs, land at {target}, {spacing_words} metres separation. Once both are down, request clearance from a "
        "watcher. On a yes, number one returns to its home port and lands, number two flies to {next} and lands. On a no,"
        " both stay put.",
        "Please land two light drones at {target}, {spacing} m apart, and then ask a watcher if all the children are "
        "standing back. Only after a yes does the first drone go home and land at its port, and the second fly to {next} "
        "and land there. After a no, neither moves.",
        "I want two light drones on the ground at {target}, {spacing_words} metres between them. Then have a watcher "
        "confirm that the casualty has been moved. Confirmed yes: first drone home to its port and land, second to {next}"
        " and land. Answer no: nobody moves.",
        "Two lightweight drones land at {target} with {spacing} m between them. A watcher is then asked whether the marks"
        " have been recorded. If yes, drone one returns to its own port and lands there and drone two flies to {next} and"
        " lands there. If no, both remain where they landed.",
        "Please two light drones to {target}, they land there with {spacing_words} metres distance between them. After "
        "this you ask a watcher if my group has made all its photos. Says he yes, the first flies home and lands at its "
        "port, the second flies to {next} and lands. Says he no, both stay.",
        "land two light drones at {target}, {spacing} m apart. then ask a watcher if theyre both sitting ok on the "
        "ground. if its a yes the first one goes home and lands at its port and the second one goes to {next} and lands "
        "there. if its a no they dont move",
        "Nobody leaves without a watcher's yes. Two light drones land at {target}, {spacing_words} metres apart; then ask"
        " a watcher: did we get the shot? On yes, the first goes home and lands at its port while the second flies to "
        "{next} and lands. On no, they both sit tight.",
        "Two lightweight drones shall land at {target}, {spacing} metres apart, whereupon a watcher shall be asked "
        "whether departure is permitted. Solely upon an affirmative answer, the first shall return to its home port and "
        "land, and the second shall proceed to {next} and land. Otherwise neither shall move.",
        "2 LWDs land at {target}, {spacing} m apart. Then ask a watcher if it's clear to leave. Yes: first goes home and "
        "lands at its port, second flies to {next} and lands. No: both stay.",
    ),
}  # fmt: skip
"""The wordings of runs 40, 41, ..., as those of `fresh.FRESH`."""
