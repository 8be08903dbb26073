"""A service as an agent: `weather.Forecast` asks a web service, and its answer is a result that a task reads.

Run it:  python weather.py --id weather_1 --site my-site     (its catalogue entry: python weather.py --catalogue)

    agents: {weather: {type: weather}}
    steps:
      - do: weather.Forecast
        with: {at: ${camp}}
        save_as: sky
      - check: sky.wind < 8 m/s
"""

import json
from typing import TypedDict
from urllib.error import URLError
from urllib.parse import urlencode
from urllib.request import urlopen

from formiga_bt.agent import ActionError, Agent, MetresPerSecond, Place, Seconds, action, run


class Sky(TypedDict):
    wind: MetresPerSecond
    rain: bool


class Weather(Agent, type="weather", mobility="none"):
    """A weather service."""

    def __init__(self, url: str = "http://127.0.0.1:8099/forecast") -> None:
        self.url = url

    @action(exclusive=False, repeatable=True, typical_s=2.0)
    def Forecast(self, at: Place, ahead: Seconds = 3600.0) -> Sky:
        """Say what the weather will be at a place."""
        asked = urlencode({"east": at.east_m, "north": at.north_m, "ahead": ahead})
        try:
            with urlopen(f"{self.url}?{asked}", timeout=10.0) as answer:
                told = json.load(answer)
        except (URLError, ValueError) as error:
            raise ActionError("no_answer", f"the weather service gives none: {error}") from error
        return {"wind": float(told["wind_m_s"]), "rain": bool(told["rain"])}


if __name__ == "__main__":
    run(Weather)
