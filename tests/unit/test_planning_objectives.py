"""What experiments are rewarded for, against closed forms and sampling."""

import math

import numpy as np
import pytest
from planning_scenes import experiment, planning

from base_station.planning.planner import plan
from base_station.planning.problems import alpha_problem, objective_of
from base_station.planning.searches.shooting import shooting
from base_station.planning.tasks.alpha import nominal_returns
from base_station.planning.tasks.evaluation import separation
from base_station.planning.tasks.objectives import GAIN, Information, PaperDistance, known_share
from base_station.twin import EAST

EVEN = (0.5, 0.5)


def test_nothing_is_learned_from_equal_reports_and_all_from_far_ones():
    assert known_share(np.array([[0.0], [1e4]]), EVEN) == pytest.approx([0.0, 1.0])


@pytest.mark.parametrize("weights", [EVEN, (0.9, 0.1)])
def test_the_information_is_below_and_near_the_true_one(weights):
    """Mutual information of a hypothesis and a normal report, by sampling."""
    rng, prior = np.random.default_rng(0), np.array(weights)
    entropy = -(prior * np.log(prior)).sum()
    for d in (0.5, 1.0, 2.0, 4.0):
        means = np.array([0.0, d])
        which = rng.random(400_000) < prior[1]
        x = means[which.astype(int)] + rng.standard_normal(400_000)
        likelihood = np.exp(-0.5 * (x[:, None] - means) ** 2)
        own = likelihood[np.arange(len(x)), which.astype(int)]
        true = np.log(own / (likelihood @ prior)).mean() / entropy
        share = known_share(np.array([[d * d]]), weights)[0]
        assert share <= true + 0.01
        assert share >= 0.4 * true


def test_a_third_hypothesis_that_looks_like_the_second_leaves_half_a_question():
    thirds = (1 / 3, 1 / 3, 1 / 3)
    squares = np.array([[1e6, 1e6, 0.0]])  # pairs 0-1, 0-2, 1-2
    kept = 2 / 3 * math.log(2) / math.log(3)
    assert known_share(squares, thirds) == pytest.approx([1.0 - kept])


def test_the_gains_of_an_episode_add_up_to_what_is_known_in_the_end(rescue_view):
    """The same d' as the evaluation that judges plans, and the terms are its increments."""
    view = planning(rescue_view, objective="information")
    problem = alpha_problem(view, experiment(view, apart_m=1.0))
    states, memory = problem.start[None].copy(), None
    reports = [problem.reports(states)]
    memory = problem.objective.begin(reports[0])
    setpoints = np.full((1, 3, 3), np.nan)
    setpoints[..., :2] = [[0.0, 0.6], [0.0, 0.0], [0.0, 0.0]]
    gained = 0.0
    for _ in range(8):
        terms = problem.move(problem.model.nominal, states, memory, setpoints)
        reports.append(problem.reports(states))
        gained += terms["information"][0]
    d_prime = separation(np.stack(reports, axis=2))
    assert gained == pytest.approx(GAIN * known_share(d_prime[:, None] ** 2, EVEN)[0])
    assert gained > 0.5 * GAIN


def test_a_gentle_experiment_is_worth_more_than_a_rough_one_that_tells_as_much(rescue_view):
    view = planning(rescue_view, objective="information")
    problem = alpha_problem(view, experiment(view, apart_m=1.0))
    short, long_ = np.zeros((2, problem.steps, 4))
    short[:4, 1], long_[:, 1] = 0.8, 0.8
    returns = nominal_returns(problem, np.stack([short, long_]))
    assert returns[0] > returns[1] > 0.0
    view = planning(rescue_view, objective="paper_distance")
    paper = alpha_problem(view, experiment(view, apart_m=1.0))
    distances = nominal_returns(paper, np.stack([short, long_]))
    assert distances[1] > distances[0]  # the paper's reward asks for more and more distance


def test_the_printed_formula_forgets_what_the_twins_have_come_to(rescue_view):
    """The suspect drives: only the twin whose motors work gets anywhere, until it is put back."""
    came = {}
    for name in ("paper_distance", "paper_printed"):
        view = planning(rescue_view, objective=name, suspect="commanded")
        problem = alpha_problem(view, experiment(view))
        states, memory = problem.start[None].copy(), np.empty((1, 0))
        setpoints = np.full((1, 3, 3), np.nan)
        setpoints[..., :2] = [[0.0, 0.0], [0.0, 0.8], [0.0, 0.0]]
        for _ in range(3):
            problem.move(problem.model.nominal, states, memory, setpoints)
        came[name] = states[0, :, 1, EAST]
    assert came["paper_distance"] == pytest.approx([0.0, 1.0], abs=0.2)
    assert came["paper_printed"].tolist() == [0.0, 0.0]


def test_with_the_suspect_held_the_two_readings_of_the_formula_are_one(rescue_view):
    """Without power a broken motor makes no difference: the twins differ in reports alone."""
    views = [planning(rescue_view, objective=o) for o in ("paper_distance", "paper_printed")]
    problems = [alpha_problem(v, experiment(v, apart_m=1.0)) for v in views]
    plans = next(shooting(problems[0], np.random.default_rng(0)))
    own, printed = (nominal_returns(p, plans) for p in problems)
    assert own.tolist() == printed.tolist()
    assert own.max() > 0.5


def test_names_of_objectives():
    assert objective_of("paper_distance", EVEN) == PaperDistance()
    assert not objective_of("paper_printed", EVEN).own_state
    assert objective_of("information", (3.0, 1.0)) == Information((0.75, 0.25))
    with pytest.raises(KeyError):
        objective_of("curiosity", EVEN)


def test_learning_for_information_finds_an_experiment(rescue_view):
    view = planning(rescue_view, objective="information")
    answer = plan(view, experiment(view), lambda _: None)
    assert answer.plan is not None
    assert answer.plan.predicted_error <= view.diagnosis.plan_error
