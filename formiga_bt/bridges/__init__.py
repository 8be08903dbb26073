"""Bridges to other tools' formats: BehaviorTree.CPP's XML. Pure functions; `cli` reads and writes the files."""
