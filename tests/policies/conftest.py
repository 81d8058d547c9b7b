import pytest

from policies import POLICIES, Policy


@pytest.fixture(params=list(POLICIES))
def policy(request: pytest.FixtureRequest) -> type[Policy]:
    return POLICIES[str(request.param)]
