"""What runs in the child process: the jail, the check of names, threads on the virtual clock, the paper's API.

Only the standard library: the child sees no other package.
"""
