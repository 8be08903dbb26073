"""Simulated drones and people that behave like real agents: in process for tests, or as one OS process each.

They use the ground floor and the transports of formiga_bt, and know nothing of the engine. `world.SimFleet` runs them
on a scheduler, `launch.FleetProcesses` as processes over Zenoh, `referee.Referee` judges how safely they moved.
"""
