"""The keys of a site file, in tables that the reader, the schemas and the editor share."""

from typing import Final

from formiga_bt.base.routes import EDGE_WIDTH_M
from formiga_bt.base.severities import SEVERITIES
from formiga_bt.lang.kinds import ENVELOPE, Option
from formiga_bt.lang.model.world import RESUME_HOLD_AFTER_US

SITE: Final = (
    Option("formiga_site", "value", "Version of the site format.", type="int", required=True),
    Option("name", "name", "The site's name.", required=True),
    Option("base", "options", "The base station: lat, lng, ground_msl.", required=True),
    Option("actions", "words", "Its catalogues: names of those that ship, and files. `base` is always there."),
    Option("libraries", "words", "Folders of its own subtrees, where imports are looked up: [trees/lib]."),
    Option("timezone", "word", "Its IANA time zone, such as Europe/Helsinki (UTC)."),
    Option("ports", "map", "Landing ports: {at, waiting}."),
    Option("places", "map", "Named places."),
    Option("regions", "map", "Named regions: lists of places."),
    Option("resources", "map", "What only so many tasks use at a time: {capacity, region}."),
    Option("fence", "value", "The region that no flight leaves."),
    Option("no_fly", "value", "Regions that no flight enters."),
    Option("no_go", "value", "Regions that no ground machine enters."),
    Option("stations", "map", "Places of ground machines: {at, heading, charges, kinds}."),
    Option("routes", "options", "What ground machines drive on: {nodes, edges}; without it they drive straight ways."),
    Option("terrain", "options", "The ground: {flat: true, relief: 5 m} or {file: heights.asc, relief: 2 m}."),
    Option("layers", "value", "Heights at which drones cross, over the base's ground."),
    Option(
        "separation",
        "value",
        "Least distance between drones of different tasks.",
        type="distance",
        above=0.0,
        default=15.0,
    ),
    Option(
        "min_spacing",
        "value",
        "Least distance between spots that machines use.",
        type="distance",
        above=0.0,
        default=3.0,
    ),
    Option(
        "resume_hold_after",
        "value",
        "After a longer outage of the engine its tasks wait for a person.",
        type="duration",
        default=RESUME_HOLD_AFTER_US / 1e6,
    ),
    Option("envelope", "options", "What the site tightens of the envelope of every machine.", keys=ENVELOPE),
    Option("on_breach", "map", "What follows a breach of a limit; it ranks above the type's word."),
    Option("allocator", "options", "How agents are chosen for tasks that wait: {policy}."),
    Option(
        "preflight", "word", "Whether a grant needs preflight checks that are all ok.", values=("required", "shown")
    ),
    Option("pilots", "value", "The pilots: {id, max_airborne}; required in mode real."),
    Option("people", "map", "Site roles and the people who have them."),
    Option("agents", "map", "The agents: {type, home, at}."),
    Option("rules", "map", "Standing rules: {on, of, for, request, with, priority, at_most}."),
    Option(
        "news",
        "map",
        "Who is told what that happens: {webhook, mail or mqtt, what, severity, tasks, quiet, unacknowledged, text}.",
    ),
    Option("transports", "map", "How agents are reached: {zenoh: {listen}}."),
    Option("accept_missing", "map", "What mode real does without: wire -> guarantees that it lacks."),
    Option("mode", "word", "Whether unlisted agents are admitted.", values=("simulation", "real")),
)

ALLOCATOR: Final = (
    Option("policy", "word", "Each task the closest, or all together the least way.", values=("closest", "optimal")),
)
LAT: Final = Option("lat", "value", "Latitude, degrees.", required=True, least=-90.0, most=90.0)
LNG: Final = Option("lng", "value", "Longitude, degrees.", required=True, least=-180.0, most=180.0)
BASE: Final = (
    LAT,
    LNG,
    Option("ground_msl", "value", "Height of its ground over the sea.", type="distance"),
)
PORT: Final = (
    Option("at", "value", "Its place.", required=True),
    Option("waiting", "value", "Where to wait when it is taken."),
)
STATION: Final = (
    Option("at", "value", "Its place.", required=True),
    Option("heading", "value", "How a machine stands there: true, clockwise from north.", type="angle"),
    Option("charges", "flag", "Whether machines charge there."),
    Option("kinds", "words", "The types that may use it (all)."),
)
ROUTES: Final = (
    Option("nodes", "map", "Points of the routes: {at, park}. Stations are nodes, too.", required=True),
    Option("edges", "value", "Straight ways between nodes: [a, b] or [a, b, {speed, one_way, width}].", required=True),
)
NODE: Final = (
    Option("at", "value", "Its place.", required=True),
    Option("park", "flag", "Whether machines may stay there: routes end at such nodes and at stations only."),
)
EDGE: Final = (
    Option("speed", "value", "The most that is driven on it.", type="speed", above=0.0),
    Option("one_way", "flag", "Whether it is driven from the first node to the second only."),
    Option("width", "value", "How wide what drives on it is (1 m).", type="distance", above=0.0, default=EDGE_WIDTH_M),
)
TERRAIN: Final = (
    Option("flat", "flag", "Whether the ground is flat."),
    Option("file", "text", "An ESRI ASCII grid of heights over the sea, in metres east and north of the base."),
    Option("relief", "value", "How much it may rise or fall, or the file be wrong by.", type="distance", least=0.0),
)
PILOT: Final = (
    Option("id", "name", "The pilot.", required=True),
    Option("max_airborne", "value", "Machines in the air at once (1).", type="int", least=1, default=1),
)
CHANNEL: Final = (
    Option("webhook", "options", "A POST to a URL: {url, secret, private}."),
    Option("mail", "options", "A mail by a mail server: {host, port, tls, from, to, user, password, private}."),
    Option("mqtt", "options", "A topic of an MQTT broker: {host, port, tls, topic, user, password, private}."),
    Option("what", "words", "News of what: alarms, questions, ends (all of them)."),
    Option("severity", "word", "So loud at least (info).", values=SEVERITIES, default="info"),
    Option("tasks", "words", "Only news of these tasks (all, and what is no task's)."),
    Option("quiet", "text", "Hours in which only what is critical goes out, in the site's time zone: 22:00-06:00."),
    Option(
        "unacknowledged", "value", "Only alarms that nobody acknowledged within this time.", type="duration", above=0.0
    ),
    Option("text", "flag", "Whether texts and names go along, those of people too."),
)
WEBHOOK: Final = (
    Option(
        "url", "options", "Where its URL stands: {file: NAME} or {env: NAME}.", required=True, like="{file: room.url}"
    ),
    Option("secret", "options", "Where its secret stands, whsec_...", required=True, like="{file: room.secret}"),
    Option("private", "flag", "Whether its address may be of this machine or a private net, and plain HTTP."),
)
MAIL: Final = (
    Option("host", "text", "The mail server.", required=True, like="smtp.example.org"),
    Option("port", "value", "Its port (587).", type="int", least=1, default=587),
    Option("tls", "word", "How it is spoken to (starttls).", values=("starttls", "direct", "none"), default="starttls"),
    Option("from", "text", "The address that it comes from.", required=True, like="formiga@example.org"),
    Option("to", "words", "The addresses that it is for.", required=True, like="[room@example.org]"),
    Option("user", "text", "As whom to log in."),
    Option("password", "options", "Where the password stands: {file: NAME} or {env: NAME}."),
    Option("private", "flag", "Whether the server may be this machine or in a private net, and without TLS."),
)
MQTT: Final = (
    Option("host", "text", "The broker.", required=True, like="broker.example.org"),
    Option("port", "value", "Its port (8883).", type="int", least=1, default=8883),
    Option("tls", "word", "How it is spoken to (direct).", values=("direct", "none"), default="direct"),
    Option("topic", "text", "The topic.", required=True, like="meadow/news"),
    Option("user", "text", "As whom to log in."),
    Option("password", "options", "Where the password stands: {file: NAME} or {env: NAME}."),
    Option("private", "flag", "Whether the broker may be this machine or in a private net, and without TLS."),
)
SECRET: Final = (
    Option("file", "text", "A file below the folder of the site file, of mode 0600."),
    Option("env", "text", "A variable of the engine's environment."),
)
AGENT: Final = (
    Option("type", "name", "Its type.", required=True),
    Option("home", "name", "Its own port, or station."),
    Option("at", "value", "Where it stands: of what never moves; of a ground machine where it begins."),
    Option("guards", "map", "Its actions that begin only while a resource with a region is empty: {Close: doorway}."),
)
RESOURCE: Final = (
    Option("capacity", "value", "Units of it (1).", type="int", least=1, default=1),
    Option("region", "value", "Where it is: machines inside take it up, and none goes in whose task does not hold it."),
)

APPROVERS: Final = "approvers"
"""The site role of those who approve bundles in mode real; they need be no agents."""
