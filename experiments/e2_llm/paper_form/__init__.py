"""The baseline `paper-form`: models write Python against the paper's API, flown by the same simulated fleet.

`inside` is what runs in the child process with the generated code, in a jail; `flight` is the fleet that it commands, in this
process; `prompt` and `author` ask a model; `runs` judges. Nothing here runs unless the experiment is told to.
"""
