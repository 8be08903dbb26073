"""A sensor as an agent: its status says a temperature that conditions read, and it reports an event when it is too hot.

Run it:  python thermometer.py --id store_1 --site my-site     (its catalogue entry: python thermometer.py --catalogue)

    agents: {store: {type: thermometer}}
    steps:
      - wait_until: store.temperature < 8
      - wait_for: store.too_hot
        save_as: alarm
"""

import random

from formiga_bt.agent import Agent, event, run


class Thermometer(Agent, type="thermometer", mobility="none", fields={"temperature": float}):
    """A thermometer."""

    limit = 8.0
    every_s = 1.0

    @event
    def too_hot(self, temperature: float) -> None:
        """It is warmer than the limit, and was not before."""

    def read(self) -> float:
        """Return degrees Celsius; here stands the sensor."""
        return random.uniform(2.0, 9.0)

    async def main(self) -> None:
        was_hot = False
        while True:
            degrees = self.read()
            self.status(temperature=degrees)
            if degrees > self.limit and not was_hot:
                self.too_hot(temperature=degrees)
            was_hot = degrees > self.limit
            await self.sleep(self.every_s)


if __name__ == "__main__":
    run(Thermometer)
