"""The `formiga` command: one verb a file, imported only when that verb is called."""


def main() -> None:
    """Run the command line of this process and exit with its code."""
    import gc
    import sys

    if sys.argv[1:2] == ["check"]:
        gc.set_threshold(200_000, 50, 50)  # it makes many small things that all stay, and few circles
    try:
        from formiga_bt.cli.app import run

        code = run(sys.argv[1:])
    except KeyboardInterrupt:  # while something was imported
        code = 130
    sys.exit(code)
