"""A site in this process: scenarios, simulated fleets, test files, and helpers for tests.

`rehearsal` is one site on the virtual clock; `simulation` brings a scenario to life on it; `stage` plays a scenario with
processes; `cases` plays test files; `testing` is for tests of trees and engines.
"""
