"""What stands where a page would be whose scripts are not installed."""

from collections.abc import Mapping

from starlette.responses import HTMLResponse, Response

_PAGE = """<!doctype html>
<html lang="en">
<meta charset="utf-8">
<title>Surface Service</title>
<link rel="icon" href="data:,">
<h1>Surface Service</h1>
<p>{} In the project's folder, run</p>
<pre>make web</pre>
<p>and load the page again. {}</p>
</html>
"""


def not_built(what: str, rest: str, headers: Mapping[str, str]) -> Response:
    """A page that says what is not installed, what to run, and what works without it: 503."""
    return HTMLResponse(_PAGE.format(what, rest), status_code=503, headers=headers)
