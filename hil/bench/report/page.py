"""The page: HTML with everything in it, no script and no network (pure)."""

import base64
from html import escape
from typing import Any

from base_station.recording.brief import ranked
from base_station.recording.palette import hypothesis_color
from hil.bench.report.record import RunTold

CAPTIONS = {
    "trajectories": (
        "Where they went",
        "Seen from above, north up. Solid: the truth, which the station never saw. Dotted: as "
        "reported. White circles: contacts, with their time and the largest impulse of one step.",
    ),
    "residuals": (
        "What gave it away",
        "Above: reports minus what the believed twin expects, in standard deviations. Below: what "
        "has added up of it; an alarm is raised where a line crosses the dashed threshold.",
    ),
    "posterior": (
        "What the station believed",
        "Probability of each explanation. White dotted: a contact begins. Dashed: decides.",
    ),
    "learning": (
        "What it learnt",
        "Mean reward of an episode while PPO learns. Rejected attempts missed their target.",
    ),
    "timings": ("What took how long", "Fleet time is the vehicles' clock, wall time the people's."),
}
LIKELY = 0.02
KEPT = ("fault", "anomaly", "hypotheses", "plan", "contact", "verdict", "goal", "takeover", "end")
STYLE = """
:root { color-scheme: dark }
* { box-sizing: border-box }
body { margin: 0 auto; max-width: 62rem; padding: 2.5rem 1.5rem 4rem;
  background: #0d0f13; color: #e8eaee; font: 16px/1.55 system-ui, sans-serif }
h1 { font-size: 2rem; margin: 0; letter-spacing: -.01em }
h2 { font-size: 1.2rem; margin: 0 0 .3rem }
p { margin: .3rem 0 }
header { margin-bottom: 1.8rem }
section { background: #14171c; border: 1px solid #2a2f37; border-radius: .7rem;
  padding: 1.2rem 1.4rem; margin-top: 1.1rem }
.dim, figcaption, th { color: #8b929e }
.verdict { font-size: 1.7rem; font-weight: 650; margin: .1rem 0 .4rem }
.tiles { display: grid; grid-template-columns: 1fr 1fr; gap: 1.1rem }
@media (max-width: 46rem) { .tiles { grid-template-columns: 1fr } }
.badge { display: inline-block; border-radius: 1rem; padding: .1rem .8rem;
  font-size: .85rem; font-weight: 600 }
.good { background: #0b3d2f; color: #5fd6ae }
.bad { background: #4a2410; color: #ff9d66 }
table { border-collapse: collapse; width: 100%; font-size: .92rem }
th { text-align: left; font-weight: 500 }
td, th { padding: .22rem .8rem .22rem 0; vertical-align: middle }
td.n, th.n { text-align: right; font-variant-numeric: tabular-nums; white-space: nowrap }
td.wide { width: 55% }
.bar { height: .62rem; border-radius: .3rem; min-width: 2px }
.story { width: auto }
.story td { padding-right: 1.6rem; vertical-align: top }
figure { margin: 0 }
img { width: 100%; display: block; margin-top: .7rem; border-radius: .4rem }
"""


def page(run: RunTold, figures: dict[str, bytes]) -> str:
    """One document."""
    scenario, result = run.scenario, run.result
    shown = "".join(_figure(name, image) for name, image in figures.items())
    description = " ".join(scenario.description.split())
    return f"""<!doctype html>
<html lang="en"><head><meta charset="utf-8"><meta name="viewport" content="width=device-width">
<title>{escape(scenario.name)}: report of a run</title><style>{STYLE}</style></head><body>
<header><h1>{escape(scenario.name)}</h1><p>{escape(description)}</p>
<p class="dim">{len(scenario.fleet)} vehicles, seed {scenario.seed},
{run.end_s:.0f} s of fleet time</p></header>
<div class="tiles">{_verdict(run)}{_goals(run)}</div>
<section><h2>What happened</h2>{_story(run)}</section>
{shown}
<p class="dim">{escape(", ".join(f"{k} {v}" for k, v in result["versions"].items()))}</p>
</body></html>
"""


def _verdict(run: RunTold) -> str:
    result = run.result
    names = {v.sysid: v.name for v in run.scenario.fleet}
    verdict = result["verdict"]
    if verdict is None:
        said, rows = "no verdict" if result["alarm"] else "nothing is wrong", ""
    else:
        what = verdict["hypothesis"] if verdict["decided"] else "cannot tell"
        said = f"{names.get(verdict['sysid'], verdict['sysid'])}: {what}"
        rows = "".join(_probability(name, p) for name, p in ranked(verdict["posterior"]))
        rows = f"<table>{rows}</table>"
    truths = [f"{names[int(s)]}: {h}" for s, h in result["truth"]["hypotheses"].items()]
    truth = ", ".join(truths) or "nothing was broken"
    badge = _badge(result["correct"], "correct", "not correct")
    return (
        f'<section><h2>Verdict {badge}</h2><p class="verdict">{escape(said)}</p>'
        f'<p class="dim">the truth: {escape(truth)}</p>{_why(run)}{rows}</section>'
    )


def _why(run: RunTold) -> str:
    """The odds before the experiments, and what changed them: a touch, or the suspect alone."""
    if not (run.of("hypotheses") and run.of("verdict")):
        return ""
    before, verdict = run.of("hypotheses")[-1], run.of("verdict")[-1]
    posterior = ranked(before["data"]["posterior"])
    likely = ", ".join(f"{name} {p:.2f}" for name, p in posterior if p >= LIKELY)
    touches = [c for c in run.contacts if before["time_s"] <= c.start_s <= verdict["time_s"]]
    words = f"Before any experiment: {likely}."
    if not verdict["data"]["decided"]:
        return f"<p>{escape(words)}</p>"
    if touches:
        first = touches[0]
        words += (
            f" At {first.start_s:.1f} s {first.bodies[0]} and {first.bodies[1]} met; what "
            "was reported then fits one explanation only."
        )
    elif any(before["time_s"] <= e["time_s"] <= verdict["time_s"] for e in run.of("plan")):
        words += " Driven alone, it answered as one explanation only expects."
    return f"<p>{escape(words)}</p>"


def _goals(run: RunTold) -> str:
    names = {str(v.sysid): v.name for v in run.scenario.fleet}
    rows = "".join(
        f"<tr><td>{escape(names[sysid])}</td><td>{escape(goal['declared'])}</td>"
        f'<td class="n">{_seconds(goal["time_s"])}</td>'
        f'<td class="n">{goal["final_distance_m"]:.2f} m</td></tr>'
        for sysid, goal in run.result["goals"].items()
    )
    learnt = "".join(
        f"<tr><td>plan {escape(t['kind'])}</td><td>{t['timesteps'] / 1000:.0f}k steps</td>"
        f'<td class="n">{t["wall_s"]:.1f} s</td><td class="n">{t["restarts"]} restarts</td></tr>'
        for t in run.result["trainings"]
    )
    unmet = "".join(f"<p>- {escape(reason)}</p>" for reason in run.result["unmet"])
    badge = _badge(run.result["expected_met"], "as expected", "not as expected")
    return (
        f"<section><h2>Goals {badge}</h2>{unmet}<table><tr><th>vehicle</th><th>declared</th>"
        f'<th class="n">at</th><th class="n">truly off by</th></tr>{rows}</table>'
        f'<h2 style="margin-top:1rem">Learning</h2><table>{learnt}</table></section>'
    )


def _story(run: RunTold) -> str:
    rows = "".join(
        f'<tr><td class="n">{event["time_s"]:.1f} s</td>'
        f'<td class="dim">{escape(event["kind"])}</td>'
        f"<td>{escape(event['text'])}</td></tr>"
        for event in run.events
        if event["kind"] in KEPT
    )
    return f'<table class="story">{rows}</table>'


def _probability(name: str, p: float) -> str:
    red, green, blue = hypothesis_color(name)
    bar = (
        f'<div class="bar" style="width:{100 * p:.1f}%;background:rgb({red},{green},{blue})"></div>'
    )
    return f'<tr><td>{escape(name)}</td><td class="wide">{bar}</td><td class="n">{p:.3f}</td></tr>'


def _figure(name: str, image: bytes) -> str:
    title, caption = CAPTIONS[name]
    data = base64.b64encode(image).decode()
    return (
        f"<section><figure><h2>{escape(title)}</h2><figcaption>{escape(caption)}</figcaption>"
        f'<img alt="{escape(title)}" src="data:image/png;base64,{data}"></figure></section>'
    )


def _badge(good: bool, yes: str, no: str) -> str:
    return f'<span class="badge {"good" if good else "bad"}">{yes if good else no}</span>'


def _seconds(value: Any) -> str:
    return "-" if value is None else f"{value:.1f} s"
