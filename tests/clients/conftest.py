"""Failed assertions of the shared parts are explained, too."""

import pytest

pytest.register_assert_rewrite("mavsdk_client")
