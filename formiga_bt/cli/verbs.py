"""The table of verbs: name -> module and one line of help. Adding a verb is adding a line here.

Each module has one function `command(...)` with typer's annotations. Nothing is imported before its verb is called, so
`formiga --help` and `formiga check` start fast.
"""

from importlib.util import find_spec
from typing import NamedTuple


class Verb(NamedTuple):
    """A verb of the command line."""

    name: str
    module: str
    """Relative to `formiga_bt.cli`."""
    help: str

    @property
    def path(self) -> str:
        """Return the full name of the verb's module."""
        return f"formiga_bt.cli.{self.module}"


_TABLE = (
    Verb("init", "author.init", "Make a folder to start from: a site, and a first task that flies."),
    Verb("check", "author.check", "Check task and other files, report all problems at once."),
    Verb("fix", "author.fix", "Fix what has one repair only."),
    Verb("fmt", "author.fmt", "Lay files out in the canonical way."),
    Verb("explain", "author.explain", "Explain a code: what is wrong, why it matters, an example."),
    Verb("new", "author.new", "Make a task file to start from."),
    Verb("schema", "integrator.schema", "Print the JSON Schema for editors, or for language models."),
    Verb("draft", "author.draft", "Write a task for a mission in words, with a language model."),
    Verb("drafts", "author.drafts", "List, show and delete what models wrote and left for a person."),
    Verb("lsp", "integrator.lsp", "Serve an editor: problems as you type, completion, rename."),
    Verb("mcp", "integrator.mcp", "Serve an assistant: look, check, dry-run, propose."),
    Verb("show", "author.show", "Draw a task as a tree, also one that runs."),
    Verb("diff", "author.diff", "Show what changed between two tasks, as trees."),
    Verb("model", "author.model", "Show, fetch and choose the language models that write drafts."),
    Verb("export", "integrator.export", "Write a task as XML of BehaviorTree.CPP."),
    Verb("import", "integrator.import_", "Read an XML file of BehaviorTree.CPP as a task."),
    Verb("dryrun", "author.dryrun", "Run a task against simulated agents in virtual time."),
    Verb("test", "author.test", "Play the cases of test files on the virtual clock."),
    Verb(
        "sim",
        "integrator.sim",
        "Start the site's agents, simulated; or play a scenario: a fleet, its tasks, what goes wrong.",
    ),
    Verb("demo", "integrator.demo", "See a small fleet work through missions in simulation."),
    Verb("up", "operator.up", "Start the engine of a site as a service."),
    Verb("doctor", "operator.doctor", "Look a site and its machine over: what is wrong, and how to mend it."),
    Verb("backup", "operator.backup", "Write a site into one file, also while its engine runs."),
    Verb("restore", "operator.restore", "Make a site of its backup; it begins HELD."),
    Verb("run", "operator.run", "Request a task; with --follow, watch it to its end."),
    Verb("load", "operator.load", "Have the engine read new and changed task files."),
    Verb("watch", "operator.watch", "Watch all tasks and agents in the terminal; answer and stop by key."),
    Verb("tasks", "operator.tasks", "List tasks."),
    Verb("gantt", "operator.gantt", "Draw the actions of agents over time."),
    Verb("map", "operator.map", "Draw where agents went, on the site."),
    Verb("stats", "operator.stats", "Show how long things took, with their spread."),
    Verb("replay", "operator.replay", "Play the past from the journal; show a task's story."),
    Verb("journal", "operator.journal", "Show what is in the journal, export tables, remove what is old."),
    Verb("why", "operator.why", "Explain why a task waits, is held, or failed; or a machine."),
    Verb("abort", "orders.abort", "End a task."),
    Verb("hold", "orders.hold", "Stop machines: what flies hovers."),
    Verb("return", "orders.return_", "Send machines to their ports."),
    Verb("land", "orders.land", "Land machines where they are."),
    Verb("continue", "orders.continue_", "Let go on what was stopped."),
    Verb("restart", "orders.restart", "End a run of a task and begin anew."),
    Verb("assign", "orders.assign", "Give an agent to a task that waits for agents."),
    Verb("unassign", "orders.unassign", "Take an agent back from its task."),
    Verb("priority", "orders.priority", "Say which of the tasks that wait goes first."),
    Verb("cut", "orders.cut", "Stop a machine's motors."),
    Verb("lockdown", "orders.lockdown", "Nothing starts, nothing goes on, until it is released."),
    Verb("zone", "orders.zone", "Close a region for machines, or open it again."),
    Verb("handback", "orders.handback", "Give a machine back that a pilot had taken over."),
    Verb("preflight", "orders.preflight", "Show whether machines are ready to fly."),
    Verb("agents", "operator.agents", "List machines and people; clear one."),
    Verb("catalogue", "operator.catalogue", "List types and actions, and what agents announced."),
    Verb("approve", "orders.approve", "Approve a task for flights on a real site."),
    Verb("router", "operator.router", "Run the router of a site whose agents have keys."),
    Verb("access", "orders.access", "Say who may do what: accounts, roles, tokens, secrets."),
    Verb("duty", "orders.duty", "Put a pilot on duty, or take them off."),
    Verb("log", "operator.log", "Export the flight log."),
    Verb("inbox", "operator.inbox", "List the questions that wait for a person."),
    Verb("alarms", "operator.alarms", "List alarms; acknowledge one: you take care of it."),
    Verb("news", "operator.news", "List the channels of the site's news; test one."),
    Verb("handover", "operator.handover", "Print what the next shift must know, on one page."),
    Verb("rules", "operator.rules", "List standing rules; start or dismiss what waits."),
    Verb("files", "operator.files", "List or fetch the files that agents named for a task."),
    Verb("answer", "orders.answer", "Answer a question."),
    Verb("event", "orders.event", "Report an event for a person: an alarm, a call for help."),
    Verb("down", "operator.down", "End the engine, at once or when its tasks have ended."),
)


def verbs() -> dict[str, Verb]:
    """Return the verbs that this installation has, in the order of help."""
    return {verb.name: verb for verb in _TABLE if find_spec(verb.path) is not None}
