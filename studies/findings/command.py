"""The commands ``python -m studies findings`` and ``learned-*``."""

from __future__ import annotations

from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Annotated

from tyro.conf import Positional, arg

from flockesc_env.cli.exits import Exit
from flockesc_env.cli.flags import Backend
from flockesc_env.cli.output import note, show
from flockesc_env.common.extras import require
from flockesc_env.jobs import Cache
from studies.flags import prepare

RESULTS, PAGE, RUNS = Path("results/findings"), Path("docs/findings.md"), Path("runs/study")

Setting = Annotated[Positional[str], arg(help="name of a preset of training/configs", metavar="SETTING")]
Output = Annotated[Path, arg(help="folder of results; the setting's go into a folder of its name")]
Results = Annotated[Path, arg(help="folder of the studies")]
Parts = Annotated[Path, arg(help="folder that keeps finished parts")]
HeldOut = Annotated[int, arg(help="flocks that results are reported on")]
Page = Annotated[Path, arg(help="file of the Markdown page")]


def _saved(path: object) -> Exit:
    note(f"saved: {path}; now run python -m studies findings-page")
    return Exit.DONE


def run(
    setting: Setting,
    *,
    output: Output = RESULTS,
    runs: Annotated[Path, arg(help="folder of training runs; unfinished ones are continued")] = RUNS,
    learners: Annotated[
        tuple[str, ...], arg(help="some of the preset's learners; none: all that have training seeds")
    ] = (),
    held_out_flocks: HeldOut = 1000,
    tuning_flocks: Annotated[int, arg(help="other flocks, which choose the best fixed range")] = 1000,
    backend: Backend = "processes",
) -> Exit:
    """Train and evaluate all learners of one setting: one row of docs/findings.md.

    Interrupted, run it again to continue.

    Example: python -m studies findings shared
    """
    prepare(output, "train", backend=backend)
    from studies.findings.study import StudyArgs, study

    return _saved(study(StudyArgs(setting, output, runs, learners, held_out_flocks, tuning_flocks, backend)))


def references(
    setting: Setting,
    *,
    output: Output = RESULTS,
    runs: Parts = RUNS,
    held_out_flocks: HeldOut = 1000,
    backend: Backend = "processes",
) -> Exit:
    """Compute the references of one setting: what knowledge that no policy has can reach.

    ``python -m studies findings`` does the same after training. Interrupted, run it again to continue.

    Example: python -m studies findings-references shared
    """
    prepare(output, "train", backend=backend)
    from studies.findings.study import StudyArgs, study_references

    args = StudyArgs(setting, output, runs, held_out_flocks=held_out_flocks, backend=backend)
    return _saved(study_references(args))


def replay(
    settings: Annotated[
        Positional[tuple[str, ...]], arg(help="names of settings; none: all", metavar="SETTING")
    ] = (),
    *,
    results: Results = RESULTS,
    write: Annotated[bool, arg(help="replace the results by those of the replay")] = False,
    flocks: Annotated[int | None, arg(help="number of held-out flocks; None: all")] = None,
    runs: Annotated[
        Path | None, arg(help="folder that keeps finished parts; None: everything is played again")
    ] = None,
    backend: Backend = "processes",
) -> Exit:
    """Play every policy file, rule and fixed range of settings again, and compare with the results.

    Nothing is trained. The exit code is 1 if an episode differs in any bit, unless --write replaces it. Give
    --runs only to continue an interrupted replay of the same version.

    Example: python -m studies findings-replay shared line
    """
    runs_on = prepare(results if write else None, "train", backend=backend, field="results")
    from studies.findings.replay import find_studies
    from studies.findings.replay import replay as play_again
    from studies.measurements import Runner

    does_differ = False
    with TemporaryDirectory() as folder:
        runner = Runner(Cache(runs or Path(folder)), runs_on)
        for study in find_studies(settings, results):
            found = play_again(study, runner, flocks=flocks, write=write)
            show(*found.lines())
            does_differ |= bool(found.differences)
    if write:
        return _saved(results)
    return Exit.FAILED if does_differ else Exit.DONE


def explain(
    setting: Setting, *, output: Output = RESULTS, runs: Parts = RUNS, backend: Backend = "processes"
) -> Exit:
    """Hide entries of the observation from the headline policy of one setting.

    ``python -m studies findings`` does the same after training. Interrupted, run it again to continue.

    Example: python -m studies findings-explain shared
    """
    prepare(output, "train", backend=backend)
    from studies.findings.study import StudyArgs, study_explanations

    return _saved(study_explanations(StudyArgs(setting, output, runs, backend=backend)))


def losses(
    *,
    results: Results = RESULTS,
    runs: Parts = RUNS,
    minutes: Annotated[float, arg(help="minutes of training where policies lose, estimated")] = 7.0,
    backend: Backend = "processes",
) -> Exit:
    """Run the headline policies in other worlds and starts, and train policies where they lose.

    Interrupted, run it again to continue.

    Example: python -m studies findings-losses
    """
    runs_on = prepare(results, "train", backend=backend, field="results")
    from studies.findings.losses import measure_losses

    return _saved(measure_losses(results, runs, minutes, runs_on))


def information(
    *,
    results: Results = RESULTS,
    runs: Parts = RUNS,
    held_out_flocks: HeldOut = 200,
    backend: Backend = "processes",
) -> Exit:
    """Measure what candidate ranges are worth, by their number and by how far agents see the predator.

    Example: python -m studies findings-information
    """
    runs_on = prepare(results, "train", backend=backend, field="results")
    from studies.findings.information import measure_information
    from studies.measurements import Runner

    return _saved(measure_information(results, held_out_flocks, Runner(Cache(runs / "information"), runs_on)))


def mechanism(*, results: Results = RESULTS, runs: Parts = RUNS, backend: Backend = "processes") -> Exit:
    """Measure what the page says about how policies work: one agent, flying apart, fear, a video.

    Example: python -m studies findings-mechanism
    """
    runs_on = prepare(results, "train", backend=backend, field="results")
    require("video", ["pygame", "imageio_ffmpeg"])
    from studies.findings.dispersal import measure_dispersal
    from studies.findings.fear import FEAR_FLOCKS, measure_fear
    from studies.findings.one_agent import measure_agent
    from studies.findings.video import record_video
    from studies.measurements import Runner

    note(f"saved: {measure_agent(results)}")
    note(f"saved: {record_video(results)}")
    runner = Runner(Cache(runs / "mechanism"), runs_on)
    note(f"saved: {measure_fear(results, FEAR_FLOCKS, runner)}")
    return _saved(measure_dispersal(results, runner))


def coverage(*, results: Results = RESULTS) -> Exit:
    """Simulate how often the intervals of the pages contain the true mean, for few training seeds.

    Example: python -m studies findings-coverage
    """
    prepare(results, "train", field="results")
    from studies.findings.coverage import measure_coverage

    return _saved(measure_coverage(results))


def page(*, results: Results = RESULTS, page: Page = PAGE) -> Exit:
    """Write the pages of results, of details and of policy files, and the figures; print the README's table.

    Example: python -m studies findings-page
    """
    prepare(None, "train")
    from studies.findings.page import LEARNED, readme_table

    show(*readme_table(LEARNED.write(results, page)).split("\n"))
    note(f"saved: {page}")
    return Exit.DONE
