"""The table of verbs: name -> module and one line of help. Adding a verb is adding a line here.

Each module has one function `command(...)` with typer's annotations. Nothing is imported before its verb is called, so
`formiga --help` and `formiga check` start fast.
"""

from dataclasses import dataclass
from importlib.util import find_spec


@dataclass(frozen=True, slots=True)
class Verb:
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
    Verb("init", "init", "Make a folder to start from: a site, and a first task that flies."),
    Verb("check", "check", "Check task and other files, report all problems at once."),
    Verb("fix", "fix", "Mend what has one repair only."),
    Verb("fmt", "fmt", "Lay files out in the canonical way."),
    Verb("explain", "explain", "Explain a code: what is wrong, why it matters, an example."),
    Verb("new", "new", "Make a task file to start from."),
    Verb("schema", "schema", "Print the JSON Schema for editors, or for language models."),
    Verb("draft", "draft", "Write a task for a mission in words, with a language model."),
    Verb("drafts", "drafts", "List, show and delete what models wrote and left for a person."),
    Verb("lsp", "lsp", "Serve an editor: problems as you type, completion, rename."),
    Verb("mcp", "mcp", "Serve an assistant: look, check, dry-run, propose."),
    Verb("show", "show", "Draw a task as a tree, also one that runs."),
    Verb("diff", "diff", "Tell what changed between two tasks, as trees."),
    Verb("model", "model", "Show, fetch and choose the language models that write drafts."),
    Verb("export", "export", "Write a task as XML of BehaviorTree.CPP."),
    Verb("import", "import_", "Read an XML file of BehaviorTree.CPP as a task."),
    Verb("dryrun", "dryrun", "Run a task against simulated agents in virtual time."),
    Verb("test", "test", "Play the cases of test files on the virtual clock."),
    Verb("sim", "sim", "Start the site's agents, simulated; or play a scenario: a fleet, its tasks, what goes wrong."),
    Verb("demo", "demo", "See a small fleet work through missions in simulation."),
    Verb("up", "up", "Start the engine of a site as a service."),
    Verb("run", "run", "Request a task; with --follow, watch it to its end."),
    Verb("load", "load", "Have the engine read new and changed task files."),
    Verb("watch", "watch", "Watch all tasks and agents in the terminal; answer and stop by key."),
    Verb("tasks", "tasks", "List tasks."),
    Verb("gantt", "gantt", "Draw the actions of agents over time."),
    Verb("map", "map", "Draw where agents went, on the site."),
    Verb("stats", "stats", "Tell how long things took, with their spread."),
    Verb("replay", "replay", "Play the past from the journal; tell a task's story."),
    Verb("journal", "journal", "Tell what is in the journal, export tables, remove what is old."),
    Verb("why", "why", "Explain why a task waits, is held, or failed; or a machine."),
    Verb("abort", "abort", "End a task."),
    Verb("hold", "hold", "Stop machines: what flies hovers."),
    Verb("return", "return_", "Send machines to their ports."),
    Verb("land", "land", "Land machines where they are."),
    Verb("continue", "continue_", "Let go on what was stopped."),
    Verb("restart", "restart", "End a run of a task and begin anew."),
    Verb("cut", "cut", "Stop a machine's motors."),
    Verb("lockdown", "lockdown", "Nothing starts, nothing goes on, until it is released."),
    Verb("handback", "handback", "Give a machine back that a pilot had taken over."),
    Verb("preflight", "preflight", "Show whether machines are ready to fly."),
    Verb("agents", "agents", "List machines and people; clear one."),
    Verb("approve", "approve", "Approve a task for flights on a real site."),
    Verb("access", "access", "Set the secret with which a person approves and goes on duty."),
    Verb("duty", "duty", "Put a pilot on duty, or take them off."),
    Verb("log", "log", "Export the flight log."),
    Verb("inbox", "inbox", "List the questions that wait for a person."),
    Verb("answer", "answer", "Answer a question."),
    Verb("event", "event", "Tell an event for a person: an alarm, a call for help."),
    Verb("down", "down", "End the engine, at once or when its tasks have ended."),
)


def verbs() -> dict[str, Verb]:
    """Return the verbs that this installation has, in the order of help."""
    return {verb.name: verb for verb in _TABLE if find_spec(verb.path) is not None}
