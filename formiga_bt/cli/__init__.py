"""The `formiga` command: one verb a file, imported only when that verb is called."""


def main() -> None:
    """Run the command line of this process and exit with its code."""
    import sys

    from formiga_bt.cli.app import run

    sys.exit(run(sys.argv[1:]))
