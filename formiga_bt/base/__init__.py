"""The ground floor: errors, time, places, units, the sun, files that last. It imports nothing else of formiga_bt."""
