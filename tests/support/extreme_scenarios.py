"""Hypothesis strategies of scenarios with numbers up to the bounds that the core accepts."""

from typing import Any, NamedTuple

from hypothesis import strategies as st
from option_table import small_flock

import flockesc_env as fe
from flockesc_env import scenario as sc

SMALLEST, LARGEST = 1e-20, 1e20

DIVIDING = ("time_step", "mass", "speed", "initial_side")
COMPUTED = ("repulsion_strength", "alignment_strength")

Numbers = st.SearchStrategy[float]


class Bounds(NamedTuple):
    """Strategies of numbers by their use in the model."""

    coordinate: Numbers = st.floats(-LARGEST, LARGEST)
    dividing: Numbers = st.floats(SMALLEST, LARGEST)
    computed: Numbers = st.floats(0, LARGEST)
    compared: Numbers = st.floats(0, allow_infinity=False)


@st.composite
def predators(draw: st.DrawFn, numbers: Bounds) -> tuple[Any, ...]:
    coordinate, computed = numbers.coordinate, numbers.computed
    point = st.tuples(coordinate, coordinate)
    start = {"position": draw(point), "velocity": draw(point)}
    steering = start | {"max_turn_rate": draw(computed)}
    path = (start["position"], start["velocity"])
    kinds = [
        sc.ConstantVelocity(**start),
        sc.Wandering(**start, angular_diffusion=draw(computed)),
        sc.PrescribedPath(path, interval=draw(st.none() | numbers.dividing)),
        sc.Learned(**start, max_acceleration=draw(computed), max_speed=draw(numbers.dividing)),
        sc.PurePursuit(**steering, confusion_rate=draw(computed), sight=draw(numbers.compared)),
        sc.PurePursuit(**steering, target=draw(st.sampled_from(["centroid", "most_isolated", "assigned"]))),
        sc.Intercept(**steering, navigation_constant=draw(computed)),
        sc.Attracted(
            **start, strength=draw(computed), exponent=draw(st.floats(0, 10)), max_speed=draw(computed)
        ),
        sc.Encircle(**steering, radius=draw(computed), closing_speed=draw(computed)),
    ]
    chosen = tuple(draw(st.lists(st.sampled_from(kinds), min_size=1, max_size=3)))
    return (
        (*chosen, sc.Herd(**steering, distance=draw(computed), partner=0)) if draw(st.booleans()) else chosen
    )


@st.composite
def flocks(draw: st.DrawFn, numbers: Bounds) -> fe.FlockScenario:
    motions = st.builds(sc.Reynolds, numbers.computed, numbers.computed, numbers.compared)
    motions |= st.builds(sc.PreferredDistance, numbers.computed, numbers.computed, numbers.dividing)
    motions |= st.builds(sc.Zones, numbers.compared, numbers.compared, numbers.computed)
    motions |= st.builds(sc.FirstOrder, numbers.computed, numbers.computed)
    motion = draw(st.sampled_from([sc.Inertial(), sc.Vicsek()]) | motions)
    dimension = draw(st.sampled_from([2, 3]))
    rule = draw(st.sampled_from([sc.Topological(), sc.Voronoi()])) if dimension == 2 else sc.Topological()
    return small_flock(
        dimension,
        num_agents=draw(st.integers(1, 9)),
        num_steps=6,
        **{name: draw(numbers.dividing) for name in DIVIDING},
        **{name: draw(numbers.computed) for name in COMPUTED},
        sensing_noise=0.0 if isinstance(motion, sc.Zones) else draw(numbers.computed),
        predator_range=draw(numbers.compared),
        capture_radius=draw(numbers.compared | st.none()),
        motion=motion,
        constant_speed=isinstance(motion, sc.Vicsek | sc.Zones) or draw(st.booleans()),
        angular_noise=draw(st.sampled_from([0.0, 1.0])),
        sensing_delay=draw(st.sampled_from([0, 2])),
        blind_angle=draw(st.sampled_from([0.0, 2.0])),
        predators=draw(predators(numbers)),
        **({"neighbor_rule": rule} if draw(st.booleans()) else {}),
    )
