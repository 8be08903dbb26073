"""The `formiga` command: one verb a file, imported only when that verb is called."""


def main() -> None:
    """Run the command line of this process and exit with its code."""
    import sys

    try:
        from formiga_bt.cli.app import run

        code = run(sys.argv[1:])
    except KeyboardInterrupt:  # while something was imported
        code = 130
    sys.exit(code)
