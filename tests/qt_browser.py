"""Chromium as QtWebEngine brings it (`pip install PyQt6-WebEngine`), without a screen, for `browser.Browser`.

Run as a program, `qt_browser.py PORT WIDTH HEIGHT`, it serves one page to the wire of the developer tools until it is
ended.
"""

from __future__ import annotations

import importlib.util
import os
import sys


def there() -> bool:
    """Whether QtWebEngine is installed."""
    find = importlib.util.find_spec
    return find("PyQt6") is not None and find("PyQt6.QtWebEngineCore") is not None


def main(port: str, width: str, height: str) -> None:
    os.environ |= {
        "QT_QPA_PLATFORM": "offscreen", "QTWEBENGINE_DISABLE_SANDBOX": "1", "QTWEBENGINE_REMOTE_DEBUGGING": port,
        "QTWEBENGINE_CHROMIUM_FLAGS": "--disable-gpu --disable-dev-shm-usage",
    }  # fmt: skip
    from PyQt6.QtCore import QUrl
    from PyQt6.QtWebEngineWidgets import QWebEngineView
    from PyQt6.QtWidgets import QApplication

    app = QApplication(["browser"])
    view = QWebEngineView()
    view.resize(int(width), int(height))
    view.load(QUrl("about:blank"))
    view.show()
    sys.exit(app.exec())


if __name__ == "__main__":
    main(*sys.argv[1:])
