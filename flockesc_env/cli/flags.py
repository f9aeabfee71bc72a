"""Flags shared by several commands: scenario, policies, seeds, JSON, progress bar, threads."""

import dataclasses
import importlib
import importlib.util
import inspect
import json
import pickle
import sys
from collections.abc import Callable, Iterable, Sequence
from contextlib import suppress
from difflib import get_close_matches
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from tyro.conf import DisallowNone, UseAppendAction, arg
from tyro.constructors import ConstructorRegistry, PrimitiveConstructorSpec, PrimitiveTypeInfo

from flockesc_env.cli.output import note
from flockesc_env.common.checks import parse_json, parse_number
from flockesc_env.common.errors import InputError, errors_at, shown, shown_name
from flockesc_env.common.extras import require
from flockesc_env.common.files import suffix_of
from flockesc_env.models.records import versions
from flockesc_env.policies.base import BasePolicy
from flockesc_env.policies.registry import EXPECTED as NAMED
from flockesc_env.policies.registry import PREDATORS, as_policy, as_predator_policy, load_policy, policy_file
from flockesc_env.policies.sb3 import SB3Policy
from flockesc_env.scenario.document import check_not_drawn, field_at, from_fields, parse_document
from flockesc_env.scenario.flock import FlockScenario
from flockesc_env.scenario.line import LineScenario
from flockesc_env.scenario.presets import MODELS, PRESETS, Scenario, preset
from flockesc_env.taskset.results import is_code

if TYPE_CHECKING:
    from flockesc_env.taskset.task import Task

MODEL = "ALGORITHM:FILE.zip, such as PPO:model.zip, or ALGORITHM:FOLDER of best_model_save_path"
_FOLDER = "the folder of a training run, module:function"
EXPECTED = f"{NAMED}, {_FOLDER} or, of stable-baselines3, {MODEL} (a pickle: code in it is executed)"
"""What ``policy_of`` takes."""

_BEST, _STATISTICS = "best_model.zip", "vecnormalize.pkl"  # of ``FlockEvalCallback``
_SB3 = ("stable_baselines3", "sb3_contrib")


def optional(help_: str, default: str, metavar: str | None = None) -> tuple[Any, ...]:
    """Return the annotations of an optional flag; ``default`` describes its default."""
    return DisallowNone, arg(help=help_, help_behavior_hint=f"(default: {default})", metavar=metavar)


def several(help_: str, metavar: str) -> Any:
    """Return the annotation of one or more positional arguments."""
    return arg(help=help_, metavar=metavar, help_behavior_hint="(at least one)")


def _parsed(
    metavar: str,
    parse: Callable[[str], Any],
    kinds: type | tuple[type, ...],
    show: Callable[[Any], str] = str,
) -> PrimitiveConstructorSpec[Any]:
    """Return how tyro reads a flag with one word; it prints a ``ValueError`` of ``parse``."""
    return PrimitiveConstructorSpec(
        nargs=1,
        metavar=metavar,
        instance_from_str=lambda words: parse(words[0]),
        is_instance=lambda value: isinstance(value, kinds),
        str_from_instance=lambda value: [show(value)],
    )


NUMBERS = ConstructorRegistry()
"""How tyro reads the numbers of flags."""


@NUMBERS.primitive_rule
def _number(flag: PrimitiveTypeInfo) -> PrimitiveConstructorSpec[Any] | None:
    kind = flag.type
    if kind not in {int, float}:
        return None
    return _parsed(kind.__name__.upper(), lambda text: parse_number(text, kind), (int, kind))


def _range(text: str) -> range:
    try:
        numbers = [parse_number(word, int) for word in text.split(":")]
        start, stop = numbers if len(numbers) > 1 else (0, *numbers)
        if 0 <= start < stop <= 2**64 and stop - start <= sys.maxsize:
            return range(start, stop)
    except ValueError:
        pass
    raise ValueError(f"expected N >= 1, or START:STOP with 0 <= START < STOP <= 2^64, got {text!r}")


Json = Annotated[bool, arg(help="print the result as a JSON document on stdout")]
Progress = Annotated[bool, arg(help="show a progress bar even if stderr is not a terminal")]
Threads = Annotated[int | None, *optional("number of threads; results do not depend on it", "one per core")]
BACKEND = (
    "where jobs run: serial, processes[:N], ray[:ADDRESS] or slurm[:KEY=VALUE,..] (docs/long-work.md);"
    " results do not depend on it"
)
Backend = Annotated[str, arg(help=BACKEND, metavar="BACKEND")]
Seeds = Annotated[range, _parsed("N|START:STOP", _range, range, lambda value: f"{value.start}:{value.stop}")]


@dataclasses.dataclass(frozen=True)
class ScenarioFlags:
    """Choose a scenario (a preset or a file) and change its fields."""

    scenario: Annotated[
        str | None,
        *optional(
            "preset (flockesc presets lists them) or scenario file",
            "that of a trained policy, or paper-flock",
            "NAME|FILE",
        ),
    ] = None
    changes: Annotated[
        UseAppendAction[tuple[str, ...]],
        arg(
            name="set",
            help="change a field, for example num_agents=100, predators.0.max_turn_rate=3 or motion=vicsek;"
            " the value is JSON or a string; can be repeated",
            metavar="PATH=VALUE",
            help_behavior_hint="(default: no changes)",
        ),
    ] = ()

    def build(self, policies: Iterable[BasePolicy] = ()) -> Scenario:
        """Return the scenario that the flags describe.

        Without ``--scenario`` it begins as that of the first policy that knows one.
        """
        known = (policy.scenario for policy in policies if policy.scenario is not None)
        scenario = next(known, FlockScenario()) if self.scenario is None else scenario_named(self.scenario)
        return _changed(scenario, self.changes) if self.changes else scenario

    def hunted(self, policies: Iterable[BasePolicy], predator: str | None) -> tuple[Scenario, Any]:
        """Return ``build`` and the policy of predators; with one, the scenario has ``Learned`` predators."""
        hunter = None if predator is None else policy_of(predator, read=as_predator_policy)
        scenario = self.build([*policies, *([] if hunter is None else [hunter])])
        if hunter is not None and isinstance(scenario, FlockScenario) and not scenario.num_learned:
            scenario = scenario.with_learned_predators()
        return scenario, hunter


_HUNTERS = f"policy of the predators: {', '.join(PREDATORS)}, a file (.npz) or a model"
Predator = Annotated[str | None, *optional(_HUNTERS, "that of the training, or none")]
"""A flag whose policy ``ScenarioFlags.hunted`` returns."""


def described(command: str, scenario: Scenario, output: Path | None) -> dict[str, Any]:
    """Return what the JSON document of every command with a scenario says; ``model``: flock or line."""
    return {
        "command": command,
        "model": scenario.model,
        "scenario": json.loads(scenario.to_json()),
        "output": output and str(output),
        "versions": versions(),
    }


def similar_field(flags: Sequence[str], command: Callable[..., Any]) -> str | None:
    """Return the field of a command's scenario that is similar to an unknown flag, or ``None``."""
    known = inspect.signature(command).parameters
    if "scenario" not in known:
        return None
    fields = {field.name for model in MODELS.values() for field in dataclasses.fields(model)}
    names = [word[2:].partition("=")[0].replace("-", "_") for word in flags if word.startswith("--")]
    unknown = [name for name in names if name not in known]
    return next((field for name in unknown for field in get_close_matches(name, fields, 1, 0.85)), None)


def scenario_named(name: str) -> Scenario:
    """Return a preset or the scenario in a file."""
    path = Path(name)
    if name in PRESETS:
        return preset(name)
    if not path.suffix and not path.exists():
        raise InputError("scenario", f"a file or one of {', '.join(PRESETS)}", shown_name(name, PRESETS))
    try:
        text = path.read_text(encoding="utf-8-sig")
    except UnicodeDecodeError as error:
        raise InputError(str(path), "TOML or JSON", error) from None
    with errors_at(f"{path}: "):
        fields = parse_document(text, is_toml=suffix_of(path) == ".toml")
        # A document with a field that only ``LineScenario`` has is a line.
        known = {field.name for field in dataclasses.fields(LineScenario)} - vars(FlockScenario()).keys()
        is_line = isinstance(fields, dict) and not known.isdisjoint(fields)
        return from_fields(MODELS["line" if is_line else "flock"], fields)


def _changed(scenario: Scenario, changes: Sequence[str]) -> Scenario:
    """Return a scenario with some changes ``PATH=VALUE``; unknown names in paths raise ``InputError``."""
    document = json.loads(scenario.to_json())
    for change in changes:
        path, is_given, text = change.partition("=")
        if not is_given:
            raise InputError("set", "PATH=VALUE", shown(change))
        parent, key = field_at(document, path, path)
        value = _value(text, path)
        is_kind = isinstance(value, str) and isinstance(parent[key], dict)
        parent[key] = {value: {}} if is_kind else value
        with suppress(InputError):  # later changes may make the scenario valid
            document = json.loads(type(scenario).from_json(json.dumps(document)).to_json())
    changed = type(scenario).from_json(json.dumps(document))
    check_not_drawn(changed, (change.partition("=")[0] for change in changes))
    return changed


def _value(text: str, path: str) -> Any:
    """Return the value of a change: None, JSON, or otherwise the string itself."""
    try:
        return None if text == "None" else parse_json(text)
    except ValueError as error:
        if text.lstrip()[:1] in {"{", "["}:
            raise InputError(path, "valid JSON", error) from None
        return text


def policy_of(
    spec: str, *, task: "Task | None" = None, read: Callable[[str], BasePolicy] = load_policy
) -> BasePolicy:
    """Return the policy of an argument: what ``read`` takes, ``module:function``, or a model.

    The function returns a policy; its module may lie in the current folder. A model of stable-baselines3,
    for example ``PPO:model.zip``, that does not know its options plays with those of the task, if one is
    given. The file vecnormalize.pkl beside it has the statistics of its observations. Code in both is
    executed.
    """
    has_model = Path(spec.rpartition(":")[2], _BEST).is_file() and policy_file(spec) is None
    if suffix_of(spec) == ".zip" or has_model:
        return _model_policy(spec, task)
    if not is_code(spec):
        return read(spec)
    module, _, function = spec.partition(":")
    if str(Path.cwd()) not in sys.path:
        sys.path.append(str(Path.cwd()))  # the script `flockesc` does not search there
    try:
        policy = getattr(importlib.import_module(module), function)()
    except (Exception, SystemExit) as error:  # the user's own code
        raise InputError("policy", f"one of {EXPECTED}", f"{spec!r} ({error!r})") from error
    return as_policy(policy, spec)


def _model_policy(spec: str, task: "Task | None") -> BasePolicy:
    require("sb3", ["stable_baselines3"])
    name, _, path = spec.rpartition(":")
    file = Path(path, _BEST) if Path(path, _BEST).is_file() else Path(path)
    statistics, normalizer = file.with_name(_STATISTICS), None
    try:
        packages = [importlib.import_module(package) for package in _SB3 if importlib.util.find_spec(package)]
        package = next((each for each in packages if hasattr(each, name)), packages[0])
        model = getattr(package, name).load(file, device="cpu")
        if statistics.is_file():
            note(f"{statistics} normalizes the observations of {file}")
            normalizer = pickle.loads(statistics.read_bytes())  # noqa: S301, a model is a pickle, too
            normalizer.venv = None
    except (Exception, SystemExit) as error:  # the class, its code and the files are the user's
        expected = f"{MODEL}, with a class of stable-baselines3 or sb3-contrib, such as PPO:{path}"
        raise InputError("policy", expected, f"{spec!r} ({error!r})") from error
    policy = SB3Policy(model, vec_normalize=normalizer)
    stated: dict[str, Any] = {}
    if task is not None and policy.options is None:
        stated = {"per_agent": task.per_agent, "scenario": task.scenario, **task.options}
    elif policy.options is None:
        expected = (
            "a model that knows its scenario and options: one of RangePolicy or ScorerPolicy, or judged by"
            " FlockEvalCallback (save_policy(model, 'model.npz') after its training writes any)"
        )
        raise InputError("policy", expected, repr(spec))
    return policy.with_options(name=Path(path).stem, **stated)
