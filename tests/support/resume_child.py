"""A training run in a separate process, which may be killed; imported by the server that forks it."""

from __future__ import annotations

import pickle
from pathlib import Path

import torch
from training.config import Args, ImitationArgs, PPOArgs, SearchArgs
from training.ppo import PPORounds
from training.tqc import TQCRounds

from training.train import train


def run(args: Args, weights: Path) -> None:
    """Train, then write all parameters of the networks and optimizers."""
    torch.set_num_threads(1)
    if isinstance(args, SearchArgs | ImitationArgs):
        train(args)
        return
    rounds = (PPORounds if isinstance(args, PPOArgs) else TQCRounds)(args)
    rounds.train()
    weights.write_bytes(pickle.dumps(rounds.state()))
