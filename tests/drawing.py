"""Marks for tests that need something to draw with."""

import shutil
from pathlib import Path

import pytest

CHROMIUM = shutil.which("chromium") or shutil.which("google-chrome")
_FOLDERS = ("/usr/share/vulkan/icd.d", "/etc/vulkan/icd.d", "/usr/local/share/vulkan/icd.d")
_DRIVERS = [driver for folder in _FOLDERS for driver in Path(folder).glob("*.json")]

needs_vulkan = pytest.mark.skipif(not _DRIVERS, reason="no Vulkan driver: no picture can be drawn")
needs_browser = pytest.mark.skipif(not CHROMIUM, reason="no Chromium is installed")
