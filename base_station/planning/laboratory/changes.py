"""What an ablation changes, by its name (pure). Everything else stays as it is."""

from dataclasses import replace

from base_station.planning.tasks.alpha import AlphaProblem
from base_station.planning.tasks.beta import BetaProblem
from hil.scenario import StationView, Uncertainty

EXACT = Uncertainty(
    motor_gain_sigma=0.0, mass_sigma=0.0, rolling_sigma=0.0, friction_max=0.0, latency_max_s=0.0
)
TWICE = Uncertainty(
    motor_gain_sigma=0.06, mass_sigma=0.04, rolling_sigma=0.2, friction_max=0.6, latency_max_s=0.1
)
UNSURE = {"twin exact": EXACT, "twin twice as unsure": TWICE}


def changed_view(view: StationView, change: str) -> StationView:
    """The view with another control period, or with the suspect commanded."""
    hz = {"control at 5 Hz": 5.0, "control at 1 Hz": 1.0}.get(change)
    if hz is not None:
        view = view.model_copy(update={"clock": view.clock.model_copy(update={"control_hz": hz})})
    if change == "suspect commanded":
        planning = view.planning.model_copy(update={"suspect": "commanded"})
        view = view.model_copy(update={"planning": planning})
    return view


def changed_problem(problem: AlphaProblem, change: str) -> AlphaProblem:
    """The experiment as it is learned; it is judged as it was."""
    if change in UNSURE:
        return replace(problem, declared=UNSURE[change])
    if change == "starts exact":
        return replace(problem, start_sigma_m=0.0)
    if change == "starts twice as spread":
        return replace(problem, start_sigma_m=2.0 * problem.start_sigma_m)
    if change == "no near starts":
        return replace(problem, near_starts=0.0)
    return problem


def changed_mission(problem: BetaProblem, change: str) -> BetaProblem:
    """The mission as it is learned."""
    if change == "no shaping":
        return replace(problem, shaped=False)
    if change == "no near starts":
        return replace(problem, curriculum=False)
    if change == "paper's reward":
        return replace(problem, base="paper", shaped=False, curriculum=False)
    return problem
