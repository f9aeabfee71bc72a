"""Observation entries by their definition in docs/model.md, in plain NumPy, agent by agent."""

from typing import Any

import numpy as np
import reference
from objective_values import VALUES
from reference import Floats, FlockState, unit

from flockesc_env import EnvOptions, FlockScenario
from flockesc_env.scenario import Learned
from flockesc_env.scenario.objectives import FLOCK_OBJECTIVES

HALF_COUNT = 8


def squash(value: float, scale: float) -> float:
    return float(value / (value + scale))


def cosine(vector: Floats, direction: Floats) -> float:
    return float(unit(vector) @ direction)


def closest_approach(offset: Floats, relative: Floats) -> tuple[float, float]:
    """Return the smallest length of offset + relative t for t >= 0, and t."""
    speed = relative @ relative
    time = max(0.0, -(offset @ relative) / speed) if speed > 0 else 0.0
    return reference.length(offset + relative * time), time


def nearest_predator(state: FlockState, position: Floats) -> int:
    return int(np.argmin(np.linalg.norm(state.predator_positions - position, axis=1)))


class Reference:
    """A flock of the NumPy model with the memory that its observations need; rows have all entries."""

    def __init__(self, scenario: FlockScenario, options: EnvOptions, state: FlockState) -> None:
        self.scenario, self.options, self.state = scenario, options, state
        self.learned = [k for k, each in enumerate(scenario.predators) if isinstance(each, Learned)]
        self.step_count = 0
        self.names = np.arange(scenario.num_agents)
        self.ranges = np.zeros(scenario.num_agents)
        self.heard = [np.array([agent]) for agent in range(scenario.num_agents)]
        self.heard_velocities = state.velocities
        self.running_minimum = self.objective()

    def objective(self) -> float:
        distances = self.distances()
        return VALUES[self.options.objective](distances, self.scenario.num_agents) if len(distances) else 0.0

    def distances(self) -> Floats:
        return reference.predator_distances(self.state.positions, self.state.predator_positions)

    def step(self, ranges: Floats, pushes: Floats) -> None:
        """Advance one step; ``pushes`` are the actions of the learned predators."""
        own = ranges[self.names]
        graph = reference.directed_graph(self.state.positions, own)
        velocities, names = self.state.velocities, self.names
        steered = {k: self.pushed(k, push) for k, push in zip(self.learned, pushes, strict=True)}
        self.state = reference.flock_step(self.scenario, self.state, own)
        for k, velocity in steered.items():
            self.state.predator_velocities[k] = velocity
        self.names = self.state.names
        self.heard = [np.flatnonzero(row) for row in graph[np.isin(names, self.names)]]
        self.heard_velocities = np.array([velocities[agents].mean(axis=0) for agents in self.heard])
        self.ranges = ranges
        self.step_count += 1
        self.running_minimum = min(self.running_minimum, self.objective())

    def common(self, agent: int) -> dict[str, float]:
        minimum, is_share = self.running_minimum, not FLOCK_OBJECTIVES[self.options.objective].unit
        return {
            "time": self.step_count / self.scenario.num_steps,
            "running_minimum": minimum if is_share else squash(minimum, self.scenario.initial_side),
            "last_range": self.ranges[agent] / self.options.max_range,
        }

    def time_of_approach(self, predator: int) -> float:
        """Return when the root mean square distance from a predator would be smallest."""
        offsets = self.state.positions - self.state.predator_positions[predator]
        relative = self.state.velocities - self.state.predator_velocities[predator]
        return closest_approach(offsets.ravel(), relative.ravel())[1]

    def place_of_approach(self, predator: int) -> Floats:
        chase = self.state.predator_velocities[predator] * self.time_of_approach(predator)
        return self.state.predator_positions[predator] + chase

    def share(self, velocity: Floats) -> Floats:
        return velocity / (np.linalg.norm(velocity) + self.scenario.speed)

    def flock_view(self) -> list[dict[str, float]]:
        scenario, state, distances = self.scenario, self.state, self.distances()
        if not len(distances):
            return [self.common(0)]
        side, positions, velocities = scenario.initial_side, state.positions, state.velocities
        centroid, velocity = positions.mean(axis=0), velocities.mean(axis=0)
        spread = np.sqrt(((positions - centroid) ** 2).sum(axis=1).mean())
        counts = np.array([len(agents) - 1 for agents in self.heard])
        alignment = [squash(np.linalg.norm(mean), scenario.speed) for mean in self.heard_velocities]
        row = self.common(0) | {
            "speed": squash(np.linalg.norm(velocities, axis=1).mean(), scenario.speed),
            "polarization": reference.polarization(velocities),
            "spread": squash(spread, side),
            "neighbor_count": (counts / (counts + HALF_COUNT)).mean(),
            "heard_alignment": np.mean(alignment),
            "predator_sensed": float(distances.min() <= self.options.predator_sensing_range),
        }
        if not row["predator_sensed"]:
            return [row]
        places = np.array([self.place_of_approach(k) for k in range(len(state.predator_positions))])
        cosines, escapes = [], []
        for r, v in zip(positions, velocities, strict=True):
            cosines.append(cosine(v, unit(r - state.predator_positions[nearest_predator(state, r)])))
            escapes.append(cosine(v, unit(r - places[np.linalg.norm(places - r, axis=1).argmin()])))
        smallest, means = [], []
        for k, predator in enumerate(state.predator_positions):
            offsets, relative = positions - predator, velocities - state.predator_velocities[k]
            time = self.time_of_approach(k)
            means.append((np.linalg.norm(offsets + relative * time, axis=1).mean(), time))
            smallest += [closest_approach(*each)[0] for each in zip(offsets, relative, strict=True)]
        closest, time = min(means)
        in_range = distances <= scenario.predator_range
        predator = nearest_predator(state, centroid)
        chase = state.predator_velocities[predator]
        away = unit(centroid - state.predator_positions[predator])
        row |= {
            "mean_distance": squash(distances.mean(), side),
            "min_distance": squash(distances.min(), side),
            "centroid_distance": squash(np.linalg.norm(centroid - state.predator_positions[predator]), side),
            "fraction_in_range": in_range.mean(),
            "heading_away": np.mean(cosines),
            "heading_away_in_range": np.array(cosines)[in_range].mean() if in_range.any() else 0.0,
            "velocity_away": self.share(velocity) @ away,
            "predator_speed": squash(np.linalg.norm(chase), scenario.speed),
            "predator_aim": unit(chase) @ away,
            "heading_escape": np.mean(escapes),
            "closest_mean_distance": squash(closest, side),
            "closest_min_distance": squash(min(smallest), side),
            "closest_approach_time": squash(time, side / scenario.speed),
        }
        return [row]

    def agent_view(self) -> list[dict[str, float]]:
        rows = {name: self.agent_row(place) for place, name in enumerate(self.names)}
        return [rows.get(name, {}) for name in range(self.scenario.num_agents)]

    def agent_row(self, agent: int) -> dict[str, float]:
        scenario, state, side = self.scenario, self.state, self.scenario.initial_side
        position, velocity = state.positions[agent], state.velocities[agent]
        heard = self.heard_velocities[agent]
        offsets = position - state.predator_positions
        distances = np.linalg.norm(offsets, axis=1)
        sensed = np.flatnonzero(distances <= self.options.predator_sensing_range)
        predator = nearest_predator(state, position)
        sight = chase = escape = np.zeros_like(heard)
        if predator in sensed:
            sight = unit(-offsets[predator])
            chase = state.predator_velocities[predator] - velocity
            escape = unit(position - self.place_of_approach(predator))
        apart = np.linalg.norm(state.positions - position, axis=1)
        near = [apart <= rho for rho in self.options.profile_ranges or ()]
        means = [state.velocities[each].mean(axis=0) for each in near]
        axes = frame(velocity, [sight, heard, chase, *means])

        def approach(velocity: Floats) -> tuple[float, float]:
            pairs = [closest_approach(offsets[k], velocity - state.predator_velocities[k]) for k in sensed]
            distance, time = min(pairs, default=(0.0, 0.0))
            return squash(distance, side), squash(time, side / scenario.speed)

        def turned(aim: Floats) -> Floats:
            return unit(aim) * np.linalg.norm(velocity) if aim.any() else velocity

        row = self.common(self.names[agent]) | {
            "speed": squash(np.linalg.norm(velocity), scenario.speed),
            "neighbor_count": squash(len(self.heard[agent]) - 1, HALF_COUNT),
            "predator_sensed": float(predator in sensed),
            "predator_distance": squash(distances[predator], side) if predator in sensed else 0.0,
            "heard_escape_gain": (cosine(heard, escape) - cosine(velocity, escape)) / 2,
            "heard_closest_approach": approach(turned(heard))[0],
        }
        row["closest_approach"], row["closest_approach_time"] = approach(velocity)
        vectors = {
            "heard_velocity": self.share(heard),
            "predator_direction": sight,
            "predator_velocity": self.share(chase),
            "escape_direction": escape,
        }
        for k, (mean, neighbors) in enumerate(zip(means, near, strict=True)):
            vectors[f"profile_{k}_velocity"] = self.share(mean)
            row[f"profile_{k}_neighbor_count"] = squash(neighbors.sum() - 1, HALF_COUNT)
            row[f"profile_{k}_escape_cosine"] = cosine(mean, escape)
            row[f"profile_{k}_closest_approach"], _ = approach(turned(mean))
        for name, vector in vectors.items():
            for axis, direction in zip(("ahead", "left", "up"), axes, strict=False):
                row[f"{name}_{axis}"] = direction @ vector
        return row

    def predator_cues(self, index: int) -> dict[str, Floats]:
        """Return all vectors that a predator sees, in m and m/s; 0 if an agent or predator is missing."""
        state = self.state
        position, velocity = state.predator_positions[index], state.predator_velocities[index]
        nearest = np.argmin(np.linalg.norm(state.positions - position, axis=1))
        others = np.delete(state.predator_positions, index, axis=0) - position
        other = others[np.argmin(np.linalg.norm(others, axis=1))] if len(others) else np.zeros_like(position)
        return {
            "nearest": state.positions[nearest] - position,
            "nearest_velocity": state.velocities[nearest] - velocity,
            "centroid": state.positions.mean(axis=0) - position,
            "flock_velocity": state.velocities.mean(axis=0) - velocity,
            "other": other,
        }

    def predator_frame(self, index: int) -> Floats:
        """Return the axes ahead, left(, up): ahead is the heading, left the side of the nearest agent."""
        cues = list(self.predator_cues(index).values())
        velocity = self.state.predator_velocities[index]
        return np.array(frame(velocity if velocity.any() else next(cue for cue in cues if cue.any()), cues))

    def pushed(self, index: int, push: Floats) -> Floats:
        """Return the next velocity of a learned predator."""
        predator: Any = self.scenario.predators[index]
        strength = push / max(reference.length(push), 1.0)
        acceleration = predator.max_acceleration * strength @ self.predator_frame(index)
        velocity = self.state.predator_velocities[index] + self.scenario.time_step * acceleration
        return velocity * min(1.0, predator.max_speed / max(reference.length(velocity), 1e-300))

    def predator_row(self, index: int) -> Floats:
        """Return the entries of the view of a learned predator in order."""
        scenario, state, common = self.scenario, self.state, self.common(0)
        predator: Any = scenario.predators[index]
        axes, seen, side = self.predator_frame(index), self.predator_cues(index), scenario.initial_side
        directions = {name: axes @ unit(cue) for name, cue in seen.items()}
        velocities = {name: axes @ self.share(cue) for name, cue in seen.items()}
        distances = {name: squash(reference.length(cue), side) for name, cue in seen.items()}
        spread = np.sqrt(((state.positions - state.positions.mean(axis=0)) ** 2).sum(axis=1).mean())
        from_agents = np.linalg.norm(state.positions - state.predator_positions[index], axis=1)
        return np.hstack(
            [
                *(common["time"], common["running_minimum"]),
                min(reference.length(state.predator_velocities[index]) / predator.max_speed, 1.0),
                *(directions["nearest"], distances["nearest"], velocities["nearest_velocity"]),
                *(directions["centroid"], distances["centroid"], velocities["flock_velocity"]),
                *(squash(spread, side), reference.polarization(state.velocities)),
                (from_agents <= scenario.predator_range).mean(),
                *(float(len(scenario.predators) > 1), directions["other"], distances["other"]),
            ]
        )


def frame(velocity: Floats, cues: list[Floats]) -> list[Floats]:
    """Return ahead, left(, up); for D = 3 left is the side of the first cue not parallel to the heading."""
    ahead = unit(velocity)
    if len(velocity) == 2:
        return [ahead, np.array([-ahead[1], ahead[0]])]
    for cue in [*cues, *np.eye(3)]:
        across = cue - ahead * (ahead @ cue)
        if np.linalg.norm(across) > 1e-6 * np.linalg.norm(cue):
            return [ahead, unit(across), np.cross(ahead, unit(across))]
    raise AssertionError("some axis is off the heading")
