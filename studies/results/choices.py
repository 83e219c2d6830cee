"""Trials of a study by a choice over their settings, as ``robots == 8 and box == "circle"``."""

import re
from collections.abc import Collection, Mapping
from dataclasses import replace

from ...core.numerics import pd
from ...core.plugins.words import near
from ..errors import SpecError
from ..spec.tables import SpecTable, flat
from .results import Results


def choose_trials(results: Results, choice: str, settings: SpecTable) -> Results:
    """Return the results of the trials of a choice, such as ``robots == 8 and box == "circle"``.

    Parameters
    ----------
    results
        Of any studies.
    choice
        As `pandas.DataFrame.query` has it, over `condition`, `seed`, and what is set and swept: by
        the last part of the key, or, where several keys end so, by the whole in backticks.
    settings
        By condition, as tables; what is swept goes before them.

    Raises
    ------
    SpecError
        If it is no choice, or names what trials have not; one line.
    """
    trials = results.trials[["condition", "seed"]]
    truths = {"true": True, "false": False}  # as they stand in a column
    known = [
        dict(flat(settings.get(c, {})))
        | {k: truths.get(v, v) for k, v in results.columns.get(c, {}).items() if v != ""}
        for c in trials["condition"]
    ]
    frame = pd.DataFrame(known, index=trials.index).assign(**trials)
    ends = [name.rpartition(".")[2] for name in frame]
    names = {end: name for end, name in zip(ends, frame, strict=True) if ends.count(end) == 1}
    frame = frame.assign(**{end: frame[name] for end, name in names.items()})
    try:
        if re.search(r"@|__", re.sub(r"'[^']*'|\"[^\"]*\"", "", choice)):
            raise ValueError("allowed: names of columns, numbers, text and comparisons")
        is_chosen = frame.eval(choice)
        if not isinstance(is_chosen, pd.Series) or is_chosen.dtype != bool:
            raise TypeError("is not true or false of each trial")
    except Exception as error:  # of pandas, of Python's parser, of what is compared
        swept = {key.rpartition(".")[2] for own in results.columns.values() for key in own}
        problem = _explain(choice, error, names, frame.columns)
        differ = ", ".join(["condition", "seed", *sorted(swept - {"condition"})])
        raise SpecError(
            f"where = {choice!r}: {problem.rstrip()}; trials differ in {differ}"
        ) from None
    keys = ["condition", "seed"]
    trials = results.trials[is_chosen].reset_index(drop=True)
    kept = pd.MultiIndex.from_frame(trials[keys])
    is_kept = pd.MultiIndex.from_frame(results.episodes[keys]).isin(kept)
    episodes = results.episodes[is_kept].reset_index(drop=True)
    columns = {c: results.columns[c] for c in results.columns if c in set(trials["condition"])}
    return replace(results, episodes=episodes, trials=trials, columns=columns)


def _explain(
    choice: str, error: Exception, names: Mapping[str, str], known: Collection[str]
) -> str:
    """Return what is wrong with a choice, in the words of a spec instead of those of pandas."""
    for key in re.findall(r"(?<![`\w.])[\w-]+(?:\.[\w-]+)+(?![`\w.])", choice):
        if key in known:
            end = key.rpartition(".")[2]
            return f"write `{key}` in backticks" + (f", or {end}" if names.get(end) == key else "")
    unknown = re.search("'(.+)'", str(error))
    if not isinstance(error, NameError) or not unknown:
        return "must be such as robots == 8 and box == 'circle'"
    name = unknown[1]
    several = [f"`{key}`" for key in known if key.rpartition(".")[2] == name]
    if several:
        return f"no key is called {name!r} alone, but {', '.join(several)}"
    nearest = near(name, known)
    return f"no key is called {name!r}" + f" ({nearest})" * bool(nearest)
