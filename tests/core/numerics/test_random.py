"""Generators as arrays."""

import numpy as np

from nested_agents.core.numerics import set_words, stream_of, words_of


def test_a_generator_goes_on_from_its_words() -> None:
    rng = np.random.default_rng(5)
    rng.integers(7, size=3, dtype=np.uint32)  # leaves half a word
    words = words_of(rng)
    other = np.random.default_rng(6)
    set_words(other, words)
    assert other.bit_generator.state == rng.bit_generator.state
    assert other.integers(7, size=3, dtype=np.uint32).tolist() == (
        rng.integers(7, size=3, dtype=np.uint32).tolist()
    )


def test_words_are_the_state_from_its_high_half_on() -> None:
    rng = np.random.default_rng(5)
    state = rng.bit_generator.state["state"]
    high, low, high_step, low_step, has_half, _ = map(int, words_of(rng))
    assert high * 2**64 + low == state["state"]
    assert high_step * 2**64 + low_step == state["inc"]
    assert has_half == 0


def test_a_stream_is_that_of_its_key() -> None:
    numbers = [stream_of(3, key).random() for key in (0, 1, 0)]
    assert numbers[0] == numbers[2] != numbers[1]
    spawned = np.random.SeedSequence(3).spawn(2)[1]
    assert numbers[1] == np.random.default_rng(spawned).random()
