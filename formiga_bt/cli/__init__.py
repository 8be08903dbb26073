"""The `formiga` command: one verb a file, imported only when that verb is called."""


def main() -> None:
    """Run the command line of this process and exit with its code."""
    import gc
    import sys

    if sys.argv[1:2] in (["check"], ["up"]):
        gc.set_threshold(200_000, 50, 50)  # they make many small things that all stay, and few circles
    try:
        from formiga_bt.cli.app import run

        code = run(sys.argv[1:])
    except KeyboardInterrupt:  # while something was imported
        code = 130
    gc.freeze()  # Python looks through all objects when it ends: of an engine a fifth of what its start costs
    sys.exit(code)
