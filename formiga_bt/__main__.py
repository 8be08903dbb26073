"""`python -m formiga_bt` is `formiga`."""

from formiga_bt.cli import main

main()
