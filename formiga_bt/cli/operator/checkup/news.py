"""The check of the news that leave the engine: that each channel can be used. Nobody is told anything by it."""

from collections.abc import Iterator

from formiga_bt.cli.operator.checkup.finding import Finding, Patient
from formiga_bt.services.news.sending import NoSecret, read_secret
from formiga_bt.services.news.ways import lacks, secrets_of


def channels(patient: Patient) -> Iterator[Finding]:
    """Check the packages and the secrets of each channel; those of the environment are the engine's own."""
    site = patient.model
    for channel in site.news.values() if site is not None else ():
        wrong = False
        if lack := lacks(channel.to):
            wrong = True
            yield Finding("fail", f"the channel {channel.name} of the news cannot be used: {lack}", str(patient.site))
        for at in secrets_of(channel.to):
            try:
                read_secret(at, patient.site.parent)
            except NoSecret as error:
                wrong = True
                text = f"the channel {channel.name} of the news has no secret: {error.text}"
                yield Finding("warn" if at.env else "fail", text, str(patient.site), error.help)
        if not wrong:
            fix = f"formiga news test {channel.name}, while the engine runs"
            yield Finding("ok", f"the channel {channel.name} of the news can be used", str(patient.site), fix)
