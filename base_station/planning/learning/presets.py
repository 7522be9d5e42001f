"""How each kind of plan is learned; the reasons are in docs/learning.md."""

from dataclasses import dataclass, replace


@dataclass(frozen=True)
class Preset:
    """`batch_size` divides `environments` x `steps` (a rollout). `total_timesteps` is also what a
    search may spend. Q-learners use `environments`, `learning_rate` (networks) and `gamma` alone.
    """

    environments: int
    steps: int
    batch_size: int
    epochs: int
    learning_rate: float
    gamma: float
    gae_lambda: float
    entropy: float
    value_weight: float
    value_clip: float | None
    initial_log_std: float
    total_timesteps: int
    check_every: int  # rollouts between looks at whether the target is met
    hidden: tuple[int, ...] = (64, 64)
    lstm_units: int = 64
    clip: float = 0.2
    max_grad_norm: float = 0.5

    @property
    def rollout(self) -> int:
        """Time steps of all environments between updates."""
        return self.environments * self.steps


PAPER = Preset(
    environments=8,
    steps=128,
    batch_size=256,  # 4 minibatches
    epochs=4,
    learning_rate=2.5e-4,
    gamma=0.99,
    gae_lambda=0.95,
    entropy=0.01,
    value_weight=0.25,  # 0.5 in the paper's loss, which halves the square once more
    value_clip=0.2,
    initial_log_std=0.0,
    total_timesteps=200_000,
    check_every=8,
    lstm_units=256,
)
TUNED_ALPHA = Preset(
    environments=32,
    steps=32,
    batch_size=256,
    epochs=8,
    learning_rate=1e-3,
    gamma=0.99,
    gae_lambda=0.95,
    entropy=0.0,
    value_weight=0.5,
    value_clip=None,
    initial_log_std=0.0,
    total_timesteps=40_000,
    check_every=10,  # a plan that only just meets the target would rest on a few centimetres
)
TUNED_BETA = replace(
    TUNED_ALPHA,
    environments=64,
    batch_size=512,
    initial_log_std=-0.5,
    total_timesteps=180_000,
    check_every=4,
)
PRESETS: dict[tuple[str, str], Preset] = {
    ("tuned", "alpha"): TUNED_ALPHA,
    ("tuned", "beta"): TUNED_BETA,
    ("paper", "alpha"): PAPER,
    ("paper", "beta"): PAPER,
}
