"""How much of a training is the environment, and how much is PPO's own update?

    python benchmarks/learning_share.py [--trainings 3]

CPU time inside the task's `step` and `reset` (twins, rewards, observations), inside looks at the
target, and the rest (rollout bookkeeping of stable-baselines3, policy, update), of whole trainings
with all steps of the preset `tuned` used. Shares of one process, so a busy machine changes little.
"""

import argparse
import time
from pathlib import Path

import numpy as np

from base_station.planning.actors import Actor, Gaussian
from base_station.planning.laboratory.jobs import Job
from base_station.planning.laboratory.measure import row_of_three
from base_station.planning.learning.lesson import Lesson
from base_station.planning.learning.ppo import train
from base_station.planning.problems import alpha_problem, beta_problem
from base_station.planning.tasks.alpha import AlphaTask
from base_station.planning.tasks.beta import BetaTask, success_share
from base_station.planning.tasks.candidates import best_candidate
from base_station.planning.tasks.task import Step, Task
from base_station.planning.trying import SUCCESS_ROLLOUTS, preset_of
from hil.scenario import StationView, load_scenario, station_view

RESCUE = Path(__file__).parents[1] / "scenarios" / "rescue.yaml"


class Timed:
    """A task that adds up the CPU time spent in it."""

    def __init__(self, task: Task) -> None:
        self._task, self.spent_s, self.progress = task, 0.0, 0.0
        self.environments = task.environments
        self.observation_size, self.action_size = task.observation_size, task.action_size

    def reset(self) -> np.ndarray:
        began_s = time.process_time()
        seen = self._task.reset()
        self.spent_s += time.process_time() - began_s
        return seen

    def step(self, actions: np.ndarray) -> Step:
        self._task.progress = self.progress
        began_s = time.process_time()
        step = self._task.step(actions)
        self.spent_s += time.process_time() - began_s
        return step


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--trainings", type=int, default=3)
    trainings = parser.parse_args().trainings
    view = station_view(load_scenario(RESCUE), mavlink_port_base=14550, station_seed=1)
    shares(view, "near", 0)  # compiles
    print("| case | environment | looks | learner | CPU s |\n|---|---|---|---|---|")
    for case in ("near", "far", "beta"):
        found = np.array([shares(view, case, seed) for seed in range(trainings)])
        inside, looks, total = np.median(found, axis=0)
        rest = total - inside - looks
        parts = " | ".join(f"{100 * part / total:.0f} %" for part in (inside, looks, rest))
        print(f"| {case} | {parts} | {total:.1f} |", flush=True)


def shares(view: StationView, case: str, seed: int) -> tuple[float, float, float]:
    """CPU time (s) in the environment, in looks, and altogether."""
    request = row_of_three(view, Job("paper", case, "ppo", "tuned", seed))
    preset, rng = preset_of(request), np.random.default_rng(seed)
    looked_s = 0.0

    def look(actor: Actor) -> bool:
        nonlocal looked_s
        began_s = time.process_time()
        if case == "beta":
            assert isinstance(actor, Gaussian)
            success_share(mission, actor.weights, np.random.default_rng(0), SUCCESS_ROLLOUTS)
        else:
            best_candidate(problem, actor, seed)
        looked_s += time.process_time() - began_s
        return False

    if case == "beta":
        mission = beta_problem(view, request)
        task = Timed(BetaTask(mission, preset.environments, rng))
    else:
        problem = alpha_problem(view, request)
        task = Timed(AlphaTask(problem, preset.environments, rng))
    began_s = time.process_time()
    train(Lesson(task, preset, seed, look, lambda *_: None))
    return task.spent_s, looked_s, time.process_time() - began_s


if __name__ == "__main__":
    main()
