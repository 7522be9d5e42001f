"""Campaign files: the YAML schema, and what it may say."""

from pathlib import Path
from typing import Annotated, Any, Literal, Self

from pydantic import Field, model_validator

from hil.scenario.fields import Model, NonNegative, Positive
from hil.scenario.loading import read_map, validated

MAX_LAYOUTS, MAX_REPEATS = 1_000_000, 1_000
SPLITS = {"tuning": 0, "test": 1}
SEEDS_PER_SPLIT = 2**30  # the seeds of a scenario end at 2^31

Planner = Literal["cem", "ppo", "shooting", "random", "gradient", "ram", "still", "passive"]
Overrides = dict[str, Any]  # key path of the scenario, or a key of `How`: value, or a draw
Name = Annotated[str, Field(pattern=r"^[A-Za-z0-9][A-Za-z0-9_.+-]{0,63}$")]


class Layouts(Model):
    """Where vehicles start and go: drawn anew for each layout, at these distances (m)."""

    count: Annotated[int, Field(ge=1, le=MAX_LAYOUTS)]
    apart_m: NonNegative = 1.0
    wall_m: NonNegative = 0.5
    travel_m: tuple[NonNegative, NonNegative] = (1.5, 6.0)

    @model_validator(mode="after")
    def _in_order(self) -> Self:
        if self.travel_m[0] >= self.travel_m[1]:
            raise ValueError("travel_m must be [least, most]")
        return self


class How(Model):
    """How a run is run; each key may also be given by a point of the grid.

    `planner` finds the experiment: one of the scenario's planners, `still` (the fleet waits for the
    plan's time), or `passive` (there is none: the verdict is what was known before). `mission` is
    what the fleet does before and after: `home` (everybody straight to the goal), `wander` (random
    weights), `ppo` (learnt, slow), or a file with a saved policy. `stop` is when a run is over:
    with the first verdict, or when the station has ended. `limit_s` of simulation time ends it
    anyway. `look_after_s`: when, after the alarm, the posterior is noted.
    """

    planner: Planner = "cem"
    mission: str = "home"
    stop: Literal["verdict", "end"] = "verdict"
    limit_s: Annotated[float, Field(gt=0, le=36_000)] = 120.0
    look_after_s: tuple[Positive, ...] = (2.0, 5.0, 10.0)


class Campaign(How):
    """`grid`: axis, name of a point, overrides. `random` applies to every run, before the grid.

    `combine: cross` runs every combination of the grid for every layout and repetition; `deal`
    gives each layout and repetition one combination, in turn. `undiagnosable` lists pairs of
    hypotheses that nobody can tell apart here; runs of these are scored apart. `headline` picks
    points of the grid: the figures of the report are about these, baselines are beside them.
    """

    name: Annotated[str, Field(pattern=r"^[a-z][a-z0-9_]{0,63}$")]
    description: str = ""
    scenario: str
    split: Literal["tuning", "test"] = "tuning"
    layouts: Layouts | None = None  # None: the scenario's own places
    repeats: Annotated[int, Field(ge=1, le=MAX_REPEATS)] = 1
    combine: Literal["cross", "deal"] = "cross"
    random: Overrides = Field(default={})
    grid: dict[Name, Annotated[dict[Name, Overrides], Field(min_length=1)]] = Field(default={})
    undiagnosable: tuple[tuple[str, str], ...] = ()
    headline: dict[str, str] = Field(default={})

    @model_validator(mode="after")
    def _headline_is_on_the_grid(self) -> Self:
        for axis, point in self.headline.items():
            if point not in self.grid.get(axis, {}):
                raise ValueError(f"headline.{axis} = {point!r} is not a point of the grid")
        return self

    @property
    def layout_count(self) -> int:
        return self.layouts.count if self.layouts else 1

    def layout_number(self, layout: int) -> int:
        """Of the `layout`th layout; those of different splits are never equal."""
        return SPLITS[self.split] * MAX_LAYOUTS + layout

    def seed(self, layout: int, repeat: int) -> int:
        """Of the world; those of different splits, layouts and repetitions are never equal."""
        return SPLITS[self.split] * SEEDS_PER_SPLIT + layout * MAX_REPEATS + repeat


HOW_KEYS = frozenset(How.model_fields)


def load_campaign(path: Path) -> Campaign:
    """Raises InputError, one line with file, field, value, limit and remedy."""
    return validated(Campaign, path, read_map(path))
