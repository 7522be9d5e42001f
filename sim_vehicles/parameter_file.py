"""Parameters in a file: lines `NAME value`, as ground stations save them (pure)."""

import math

from sim_vehicles.parameters import Parameters


def written(parameters: Parameters) -> str:
    """What has been changed; the rest is as delivered."""
    return "".join(f"{name} {value:.9g}\n" for name, value in sorted(parameters.changed().items()))


def restored(parameters: Parameters, text: str) -> list[str]:
    """Set what the text says; returns a complaint for each line that could not be followed."""
    complaints = []
    for number, line in enumerate(text.splitlines(), start=1):
        words = line.split("#", 1)[0].replace(",", " ").split()
        if words and not _followed(parameters, words):
            complaints.append(f"line {number}: {line.strip()[:60]!r} is not a parameter to be set")
    return complaints


def _followed(parameters: Parameters, words: list[str]) -> bool:
    try:
        name, value = words[0], float(words[1])
    except (IndexError, ValueError):
        return False
    if name not in parameters or not math.isfinite(value):
        return False
    return parameters.set(name, value) is None
