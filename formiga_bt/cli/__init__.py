"""The `formiga` command."""


def main() -> None:
    """Run the command line; each verb imports what it needs when it is called."""
    from formiga_bt.cli.app import app

    app()
