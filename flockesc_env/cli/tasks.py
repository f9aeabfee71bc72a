"""The commands tasks, compare, score and verify: frozen tasks and results on them."""

import secrets
import tomllib
from collections.abc import Sequence
from dataclasses import asdict
from functools import partial
from pathlib import Path
from typing import Annotated, Any

import msgspec
from tyro.conf import Positional, arg

from flockesc_env.cli.flags import EXPECTED, Json, Threads, optional, policy_of, scenario_named, several
from flockesc_env.cli.output import Exit, check_output, conclude, note, show
from flockesc_env.common.errors import FlockescError, InputError
from flockesc_env.common.extras import require
from flockesc_env.policies.compare import compare as compare_in
from flockesc_env.policies.setup import refuse
from flockesc_env.scenario.presets import PRESETS
from flockesc_env.taskset.results import SUFFIX, UNVERIFIED, Result, Training, check_learner, write_result
from flockesc_env.taskset.scoring import LoadedPolicy, draw_flocks
from flockesc_env.taskset.scoring import score as play_all
from flockesc_env.taskset.scoring import verify as play_again
from flockesc_env.taskset.task import FLOCKS, tasks

_TRAINING = "TOML file: seeds, samples, cpu_minutes, [versions], [hyperparameters]"


def run(
    name: Annotated[Positional[str | None], *optional("task to explain", "list all", "[NAME]")] = None,
) -> Exit:
    """List the tasks, or explain one: what policies see and set, and what normalizes their scores.

    docs/environments.md describes the tasks, docs/scoreboard.md their results.

    Example: flockesc tasks per-agent-visible
    """
    show(*str(tasks if name is None else tasks[name]).split("\n"))
    return Exit.DONE


def compare(
    policies: Annotated[
        Positional[tuple[str, ...]],
        arg(help=f"{EXPECTED}; none with --task: its rule alone", metavar="POLICY .."),
    ] = (),
    *,
    task: Annotated[str | None, *optional("name of a task; flockesc tasks lists them", "none")] = None,
    scenario: Annotated[
        str | None,
        *optional("preset or scenario file; with --task one of its scenarios", "that of the task or policy"),
    ] = None,
    flocks: Annotated[int, arg(help="number of held-out flocks, or lines")] = 200,
    objective: Annotated[str | None, *optional("objective, without --task", "that of the policy")] = None,
    output: Annotated[
        Path | None, *optional("folder for table and objectives", "print the table only")
    ] = None,
    num_threads: Threads = None,
    json: Json = False,
) -> Exit:
    """Compare policies with the best fixed range, in a task or any scenario.

    A task says what a policy may see, and has a rule.

    --output writes table.md and episodes.parquet.

    Example: flockesc compare stubborn-leaders --scenario pursuit
    """
    require("analysis", ["polars", "scipy"])
    chosen = None if task is None else tasks[task]
    check_output(output)
    entries = [policy_of(spec, task=chosen) for spec in policies]
    if chosen is not None:
        refuse({"objective": objective}, f"none beside --task {task}")
        found = chosen.compare(*entries, scenario=scenario, num_flocks=flocks, num_threads=num_threads)
    else:
        model = scenario if scenario is None or scenario in PRESETS else scenario_named(scenario)
        few: Any = {"num_flocks": flocks, "num_tuning": flocks}
        found = compare_in(model, *entries, objective=objective, num_threads=num_threads, **few)
    document = {
        "command": "compare",
        "task": found.task,
        "scenario": found.scenario,
        "objective": found.spec.name,
        "seeds": [*found.seeds],
        "policies": {name: asdict(row) for name, row in found.rows.items()},
    }
    conclude(document if json else str(found).split("\n"), output, found.write)
    return Exit.DONE


def score(
    policies: Annotated[
        Positional[tuple[str, ...]],
        several(f"all training seeds of a learner, or a rule: {EXPECTED}", "POLICY .."),
    ],
    *,
    task: Annotated[str, arg(help="name of a task; flockesc tasks lists them")],
    learner: Annotated[str, arg(help="name of the learner or rule")] = "",
    training: Annotated[
        Path | None, *optional(f"how the learner was trained: {_TRAINING}", "nothing is said")
    ] = None,
    output: Annotated[Path | None, *optional("write the result (.json)", "print it only")] = None,
) -> Exit:
    """Play policies on the held-out flocks of a task and print their score.

    A learner is all its training seeds, not the best one: give all of its files.

    flockesc compare --flocks N --task TASK plays few flocks, for a draft.

    Example: flockesc score ppo-0.npz ppo-1.npz --task per-agent-local
    """
    if not policies:
        raise InputError("policies", "at least one policy", "none")
    check_output(output, [SUFFIX])
    chosen = tasks[task]
    found = [LoadedPolicy.of(spec, lambda code: policy_of(code, task=chosen)) for spec in policies]
    name = learner or found[0].policy.name
    check_learner(name)
    facts = None
    if training is not None:
        try:
            facts = msgspec.convert(tomllib.loads(training.read_text("utf-8")), Training)
        except (ValueError, msgspec.ValidationError) as error:
            raise InputError("training", _TRAINING, f"{training}: {error}") from None
    result = play_all(
        found,
        chosen,
        learner=name,
        output=output,
        training=facts,
        report=lambda spec: note(f"playing {spec}"),
    )
    conclude(_lines(result, FLOCKS), output, partial(write_result, result))
    return Exit.DONE


def verify(
    files: Annotated[Positional[tuple[Path, ...]], several("results that flockesc score wrote", "FILE ..")],
    *,
    flocks: Annotated[int | None, *optional("play some flocks only, drawn at random", "all")] = None,
    draw: Annotated[int | None, *optional("seed of a draw, which repeats it", "a new one")] = None,
) -> Exit:
    """Play results again and refuse them unless every objective has the same bits.

    The task, the flocks and the checksums of files must match, too.

    Nobody verifies the names and numbers of the training, for example its samples.

    With --flocks, the output has no score: the other flocks are not verified.

    The exit code is 2 if one is refused.

    Example: flockesc verify result.json
    """
    if not files:
        raise InputError("files", "at least one file", "none")
    if flocks is None and draw is not None:
        raise InputError("draw", "--flocks beside it", draw)
    played: list[int] = [*FLOCKS]
    if flocks is not None:
        draw = secrets.randbits(32) if draw is None else draw
        played = draw_flocks(flocks, draw)
        note(f"playing {len(played):,} of {len(FLOCKS):,} flocks, which --draw {draw} repeats")
    code = Exit.DONE
    for path in files:
        try:
            result = play_again(path, flocks=played)
        except (FlockescError, OSError) as error:
            reason = str(error)
            if isinstance(error, OSError):
                reason = f"{error.filename}: {error.strerror} (flockesc score --output {path} writes one)"
            note(f"refused: {reason}")
            code = Exit.REFUSED
            continue
        head = f"{path}: verified: {len(played):,} of {len(FLOCKS):,} flocks"
        facts = f"{head}, {len(result.policies)} policies; not verified: {UNVERIFIED}"
        show(facts, *_lines(result, played))
    return code


def _lines(result: Result, flocks: Sequence[int]) -> list[str]:
    """Return the mean objective of flocks in every scenario; if they are all, also the score."""
    task, scores, at = tasks[result.task], result.scores(), [seed - FLOCKS.start for seed in flocks]
    is_whole = len(flocks) == len(FLOCKS)
    facts = "means of these flocks"
    if is_whole:
        spread = f" (training seeds: {scores.min():.3f} to {scores.max():.3f})" if len(scores) > 1 else ""
        marks = "; played by its author's code" if result.is_code else ""
        facts = f"score {scores.mean():.3f}{spread}{marks}"
    lines = [f"{task.name}, {result.learner}: {facts}"]
    for name, scale in task.scales.items():
        reached = result.values(name)[:, at].mean()
        gain = f", {task.spec.text(reached - scale.zero, '+')} over the best fixed range,"
        gain += f" {scale.best_fixed_range:g}"
        lines.append(f"  {name}: {task.spec.symbol} {task.spec.text(reached)}{gain if is_whole else ''}")
    return lines
