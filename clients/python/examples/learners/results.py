"""Learns every task by PPO and SAC of Stable-Baselines3, on the CPU, and writes curves, a table
and each policy as a few kB that NumPy replays (replay.py).

    python3 -m venv LEARN && LEARN/bin/pip install -r requirements.txt      # torch is large
    PYTHONPATH=BUILD/python LEARN/bin/python results.py [--minutes 20] [--tasks Reach-v0 ...]

A run is a task, an algorithm and a seed, and takes --minutes of CPU time. It can be ended at any
time: the same command continues it from its last checkpoint (at most a twentieth of it is lost),
and leaves out runs that have taken as long. More --minutes continue them, too; where their
checkpoints (.zip, .pkl) are missing, as in a fresh clone, they begin anew. With --only-plot nothing
is trained.
"""

from __future__ import annotations

import argparse
import csv
import itertools
import json
import time
from pathlib import Path
from typing import Any

import numpy as np

HERE = Path(__file__).resolve().parent
TASKS: dict[str, dict[str, Any]] = {  # with the options that keep a small network sufficient
    "Navigate-v0": {},
    "Corridor-v0": {},
    "Crowd-v0": {},
    "Push-v0": {},
    "Camera-v0": {"pixels": 16},
    "Hills-v0": {},
    "Reach-v0": {},
}
ALGORITHMS: dict[str, dict[str, Any]] = {
    "ppo": {
        "envs": 64,
        "n_steps": 128,
        "batch_size": 1024,
        "n_epochs": 6,
        "learning_rate": 5e-4,
        "ent_coef": 0.002,
        "policy_kwargs": {"net_arch": {"pi": [64, 64], "vf": [64, 64]}, "log_std_init": -0.5},
    },
    "sac": {
        "envs": 16,
        "learning_starts": 2000,
        "buffer_size": 200_000,
        "batch_size": 256,
        "gradient_steps": 4,
        "learning_rate": 7e-4,
        "policy_kwargs": {"net_arch": [64, 64]},
    },
}
STRETCHES = 20  # of a run: each ends with a row of the curve and a checkpoint
COLUMNS = ["steps", "cpu_s", "episodes", "success", "return"]


class Run:
    """One run, in files that begin with its name, in its task's folder."""

    def __init__(self, out: Path, task: str, algorithm: str, seed: int):
        self.task, self.algorithm, self.seed = task, algorithm, seed
        self.name = f"{task}-{algorithm}-{seed}"
        files = out / task / self.name
        self.curve, self.policy, self.record, self.model, self.buffer = (
            files.with_suffix(suffix) for suffix in (".csv", ".npz", ".json", ".zip", ".pkl")
        )

    def rows(self) -> list[dict[str, float]]:
        if not self.curve.exists():
            return []
        with self.curve.open(newline="") as file:
            return [{name: float(row[name]) for name in COLUMNS} for row in csv.DictReader(file)]

    def lasted(self, seconds: float) -> bool:
        """Whether it is complete, and took so much CPU time."""
        if not self.record.exists():
            return False
        done: float = json.loads(self.record.read_text())["cpu_s"]
        return done >= 0.99 * seconds

    def train(self, seconds: float) -> None:
        """Until it has taken so much CPU time, checkpoints of earlier calls included."""
        import torch
        from replay import success_rate

        torch.set_num_threads(1)
        self.curve.parent.mkdir(parents=True, exist_ok=True)
        rows = self.rows() if self.model.exists() else []
        model, envs = self._begin(bool(rows))
        spent = rows[-1]["cpu_s"] if rows else 0.0
        while spent < seconds:
            stretch = _Stretch(seconds / STRETCHES)
            begin = time.process_time()
            model.learn(10**9, callback=stretch, reset_num_timesteps=not rows)
            spent += time.process_time() - begin
            ended = np.array(stretch.ended or [(np.nan, np.nan)])
            success, returned = ended.mean(axis=0)
            numbers = (model.num_timesteps, spent, len(stretch.ended), success, returned)
            rows.append(dict(zip(COLUMNS, numbers)))
            self._keep(model, rows)
            shown = ", ".join(f"{name} {value:.4g}" for name, value in rows[-1].items())
            print(f"{self.name}: {shown}", flush=True)
        envs.close()
        policy = policy_of(model)
        policy.save(self.policy)
        from replay import Policy

        rate = success_rate(self.task, Policy.load(self.policy), **TASKS[self.task])
        done = {"test_success": rate, "steps": int(rows[-1]["steps"]), "cpu_s": round(spent, 3)}
        self.record.write_text(json.dumps(done) + "\n")

    def _begin(self, goes_on: bool) -> tuple[Any, Any]:
        from ruedo.gym.sb3 import SB3VecEnv
        from stable_baselines3 import PPO, SAC

        options = dict(ALGORITHMS[self.algorithm])
        envs = SB3VecEnv(f"ruedo/{self.task}", num_envs=options.pop("envs"), **TASKS[self.task])
        kind = {"ppo": PPO, "sac": SAC}[self.algorithm]
        if not goes_on:
            envs.seed(self.seed)
            return kind("MlpPolicy", envs, seed=self.seed, device="cpu", **options), envs
        model = kind.load(self.model, envs, device="cpu")
        if self.buffer.exists():
            model.load_replay_buffer(self.buffer)
        return model, envs

    def _keep(self, model: Any, rows: list[dict[str, float]]) -> None:
        """The curve at last: rows without their model would be continued by another one."""
        model.save(self.model)
        if self.algorithm == "sac":
            model.save_replay_buffer(self.buffer)
        with self.curve.open("w", newline="") as file:
            writer = csv.DictWriter(file, COLUMNS, lineterminator="\n")
            writer.writeheader()
            writer.writerows({name: f"{row[name]:.5g}" for name in COLUMNS} for row in rows)


class _Stretch:
    """A callback of Stable-Baselines3: ends after so much CPU time, and collects (success, return)
    of the episodes that end.
    """

    def __init__(self, seconds: float):
        self.ended: list[tuple[float, float]] = []
        self._end = time.process_time() + seconds

    def __call__(self, given: dict[str, Any], _: dict[str, Any]) -> bool:
        for info in given["infos"]:
            if "episode" in info:
                self.ended.append((info["is_success"], info["episode"]["r"]))
        return time.process_time() < self._end


def policy_of(model: Any) -> Any:
    """The layers that lead to the mean of the actions."""
    from replay import Policy

    if hasattr(model, "actor"):
        layers, hidden, last = [*model.actor.latent_pi, model.actor.mu], "relu", "tanh"
    else:
        net = model.policy
        layers, hidden, last = [*net.mlp_extractor.policy_net, net.action_net], "tanh", "clip"
    numbers = [
        (one.weight.detach().numpy().T.copy(), one.bias.detach().numpy().copy())
        for one in layers
        if hasattr(one, "weight")
    ]
    return Policy(numbers, hidden, last)


def band(
    curves: list[list[dict[str, float]]], column: str, at: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """The mean of the runs at these CPU seconds, and half of the width of its 95 % interval
    (Student's t); NaN for a single run.
    """
    values = np.array(
        [np.interp(at, [r["cpu_s"] for r in rows], [r[column] for r in rows]) for rows in curves]
    )
    student = {2: 12.706, 3: 4.303, 4: 3.182, 5: 2.776}.get(len(values), np.nan)
    error = values.std(axis=0, ddof=1) if len(values) > 1 else np.full(len(at), np.nan)
    return values.mean(axis=0), student * error / np.sqrt(len(values))


def table(runs: list[Run]) -> str:
    """Markdown, of the runs that are complete."""
    lines = [
        "| Task | Algorithm | Seeds | Steps | CPU minutes | Success in 100 test scenes |",
        "|---|---|---|---|---|---|",
    ]
    for (task, algorithm), group in _groups(runs):
        done = [json.loads(run.record.read_text()) for run in group]
        rates = ", ".join(f"{one['test_success']:.0%}".replace("%", " %") for one in done)
        steps = np.mean([one["steps"] for one in done])
        minutes = np.mean([one["cpu_s"] for one in done]) / 60.0
        shown = f"{steps:,.0f}".replace(",", " ")
        lines.append(
            f"| {task} | {algorithm.upper()} | {len(done)} | {shown} | {minutes:.1f} | {rates} |"
        )
    return "\n".join(lines) + "\n"


def _groups(runs: list[Run]) -> list[tuple[tuple[str, str], list[Run]]]:
    complete = [run for run in runs if run.record.exists()]
    groups = itertools.groupby(complete, lambda run: (run.task, run.algorithm))
    return [(names, list(group)) for names, group in groups]


def plot(runs: list[Run], file: Path) -> None:
    """Success during training over CPU minutes: a panel for each task, means and 95 % bands."""
    import matplotlib

    matplotlib.use("Agg")
    matplotlib.rcParams["svg.hashsalt"] = "ruedo"  # twice the same, twice the same file
    import matplotlib.pyplot as plt

    groups = _groups(runs)
    tasks = list(dict.fromkeys(task for (task, _), _ in groups))
    figure, panels = plt.subplots(
        1, len(tasks), figsize=(3.2 * len(tasks), 2.6), sharey=True, squeeze=False
    )
    for (task, algorithm), group in groups:
        panel = panels[0][tasks.index(task)]
        curves = [[row for row in run.rows() if row["episodes"]] for run in group]
        at = np.linspace(
            max(rows[0]["cpu_s"] for rows in curves), min(rows[-1]["cpu_s"] for rows in curves), 60
        )
        mean, half = band(curves, "success", at)
        colour = {"ppo": "C0", "sac": "C1"}[algorithm]
        panel.plot(at / 60.0, mean, colour, label=algorithm.upper())
        panel.fill_between(
            at / 60.0, (mean - half).clip(0, 1), (mean + half).clip(0, 1), color=colour, alpha=0.25
        )
        panel.set(title=task, xlabel="CPU minutes", ylim=(0, 1))
    panels[0][0].set_ylabel("success")
    panels[0][-1].legend()
    figure.tight_layout()
    figure.savefig(file, metadata={"Date": None})


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--tasks", nargs="+", choices=TASKS, default=list(TASKS))
    parser.add_argument("--algorithms", nargs="+", choices=ALGORITHMS, default=list(ALGORITHMS))
    parser.add_argument("--seeds", type=int, default=3, help="how many (default 3)")
    parser.add_argument("--minutes", type=float, default=20.0, help="CPU time of a run")
    parser.add_argument("--out", type=Path, default=HERE / "results")
    parser.add_argument("--only-plot", action="store_true", help="of the runs that are there")
    given = parser.parse_args()
    given.out.mkdir(parents=True, exist_ok=True)
    seeds = range(1, given.seeds + 1)
    for task, algorithm, seed in itertools.product(given.tasks, given.algorithms, seeds):
        run = Run(given.out, task, algorithm, seed)
        if not given.only_plot and not run.lasted(60.0 * given.minutes):
            run.train(60.0 * given.minutes)
    runs = [Run(given.out, *what) for what in itertools.product(TASKS, ALGORITHMS, range(1, 100))]
    if _groups(runs):
        (given.out / "results.md").write_text(table(runs))
        plot(runs, given.out / "results.svg")
        print(table(runs), end="")


if __name__ == "__main__":
    main()
