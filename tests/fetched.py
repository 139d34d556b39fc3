"""A file of a page as a browser asks for it, the name of the host as one likes."""

import http.client


def get(port: int, path: str, host: str = "localhost") -> tuple[int, dict[str, str], str]:
    """Status, headers by their names in small letters, and text."""
    asked = http.client.HTTPConnection("127.0.0.1", port, timeout=10)
    asked.putrequest("GET", path, skip_host=True)
    asked.putheader("Host", host)
    asked.endheaders()
    answer = asked.getresponse()
    found = answer.status, {name.lower(): value for name, value in answer.getheaders()}, answer.read().decode()
    asked.close()
    return found
