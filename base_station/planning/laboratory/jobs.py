"""What a reproduction consists of: jobs by study, in an order that is useful early (pure)."""

from collections.abc import Iterator
from dataclasses import asdict, dataclass
from fnmatch import fnmatchcase
from typing import Literal

from base_station.planning.laboratory.layouts import TIERS

Study = Literal["paper", "layouts", "objective", "ladder", "ablation", "cost"]

STUDIES: tuple[Study, ...] = ("paper", "layouts", "objective", "ladder", "ablation", "cost")
LEARNERS = ("ppo", "ppo_lstm", "qtable", "dqn")
SEARCHES = ("cem", "shooting", "random", "gradient", "ram")
ABLATIONS = (
    "none",
    "twin exact",
    "twin twice as unsure",
    "starts exact",
    "starts twice as spread",
    "no near starts",
    "control at 5 Hz",
    "control at 1 Hz",
    "suspect commanded",
)
MISSION_ABLATIONS = ("none", "no shaping", "no near starts", "paper's reward")
SIZES = (10, 30, 100, 300, 1000)


@dataclass(frozen=True)
class Job:
    """One training, search or timing. `case` is near, far or beta (the paper's row of three), or a
    tier of random layouts, then `number` is the layout's; else it is the seed's."""

    study: Study
    case: str
    planner: str
    preset: str
    number: int
    change: str = "none"

    @property
    def key(self) -> str:
        return "/".join(str(value) for value in asdict(self).values())


def jobs(studies: tuple[Study, ...], trainings: int, only: tuple[str, ...] = ("*",)) -> list[Job]:
    """The jobs of the studies whose key matches one of the patterns in `only`; first those with the
    first number, so that every table fills up evenly and can be looked at early."""
    every = (job for n in range(trainings) for study in studies for job in _numbered(study, n))
    return [job for job in every if any(fnmatchcase(job.key, pattern) for pattern in only)]


def _numbered(study: Study, number: int) -> Iterator[Job]:
    if study == "paper":
        for preset in ("tuned", "paper"):
            for case in ("near", "far"):
                for planner in ("ppo", "ppo_lstm"):
                    yield Job(study, case, planner, preset, number)
            yield Job(study, "beta", "ppo", preset, number)
    elif study == "layouts":
        tier = TIERS[number % len(TIERS)]
        yield Job(study, tier, "ppo", "tuned", number // len(TIERS))
    elif study == "objective":
        for case in ("near", "far"):
            for objective in ("paper_distance", "information"):
                for planner in ("ppo", "cem", "shooting"):
                    yield Job(study, case, planner, "tuned", number, objective)
    elif study == "ladder":
        for tier in TIERS:
            for planner in (*LEARNERS, *SEARCHES):
                yield Job(study, tier, planner, "tuned", number)
    elif study == "ablation":
        for change in ABLATIONS:
            yield Job(study, "far", "ppo", "tuned", number, change)
        for change in MISSION_ABLATIONS:
            yield Job(study, "beta", "ppo", "tuned", number, change)
    elif number == 0:
        for size in SIZES:
            yield Job(study, "twin", "-", "-", size)
