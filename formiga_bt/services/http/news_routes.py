"""Routes of the news that leave the engine: thin, over `NewsDesk`. `api` builds them into its app."""

from formiga_bt.base.roles import Deed
from formiga_bt.services.http.routes import FactRoutes
from formiga_bt.services.news.desk import NewsDesk
from formiga_bt.show.facts import ChannelList, ChannelTried


def add(routes: FactRoutes, news: NewsDesk) -> None:
    """Add the routes."""

    @routes.get("/v1/news", "news")
    def channels() -> ChannelList:
        """List the channels of the site's news, and how each stands; never where they lead."""
        return news.all()

    @routes.post("/v1/news/{channel}/test", "news", Deed.NEWS)
    def test(channel: str) -> ChannelTried:
        """Send a message that only says that it comes, once, and tell what came back."""
        return news.test(channel)
