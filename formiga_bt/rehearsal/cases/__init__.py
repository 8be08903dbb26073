"""Test files of tasks (`*.test.yaml`): cases on the virtual clock, with goals that fail and answers that come as a case says.

`cases` holds what a checked file is made of, `reading` reads it, `mocks` stand in for bodies and people, `running` plays one
case with the production engine, `judging` compares what came with what was expected, `coverage` tells what no case reached.
"""
