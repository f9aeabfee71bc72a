"""The engine's random numbers in plain Python: ChaCha8 (D. J. Bernstein 2008), one stream per purpose."""

import math
from collections.abc import Iterator

MASK = 2**32 - 1
PREDATORS = 4  # number of the predators' stream


class Stream:
    """The draws of the core for one seed and purpose, in order."""

    def __init__(self, seed: int, purpose: int) -> None:
        self._words = _words(_key(seed), purpose)

    def uniform(self, end: float = 1.0) -> float:
        """Draw from U[0, end) with 53 bits."""
        low, high = next(self._words), next(self._words)
        return end * ((high << 32 | low) >> 11) * 2.0**-53

    def normal(self) -> float:
        """Draw from N(0, 1), by Box and Muller."""
        radius = math.sqrt(-2 * math.log(1 - self.uniform()))
        return radius * math.cos(self.uniform(math.tau))


def _key(seed: int) -> list[int]:
    """Return the key of eight words for a seed of 64 bits: PCG32, as in ``seed_from_u64`` of rand_core."""
    key = []
    for _ in range(8):
        seed = (seed * 6364136223846793005 + 11634580027462260723) % 2**64
        shifted, turn = ((seed >> 18 ^ seed) >> 27) & MASK, seed >> 59
        key.append((shifted >> turn | shifted << (32 - turn)) & MASK)
    return key


def _words(key: list[int], stream: int) -> Iterator[int]:
    counter = 0
    while True:
        start = [0x61707865, 0x3320646E, 0x79622D32, 0x6B206574, *key]
        start += [counter & MASK, counter >> 32, stream & MASK, stream >> 32]
        state = start.copy()
        for _ in range(4):
            for column in range(4):
                _quarter(state, column, column + 4, column + 8, column + 12)
            for k in range(4):
                _quarter(state, k, 4 + (k + 1) % 4, 8 + (k + 2) % 4, 12 + (k + 3) % 4)
        yield from ((word + first) & MASK for word, first in zip(state, start, strict=True))
        counter += 1


def _quarter(state: list[int], a: int, b: int, c: int, d: int) -> None:
    for one, two, three, turn in ((a, b, d, 16), (c, d, b, 12), (a, b, d, 8), (c, d, b, 7)):
        state[one] = (state[one] + state[two]) & MASK
        mixed = state[three] ^ state[one]
        state[three] = (mixed << turn | mixed >> (32 - turn)) & MASK
