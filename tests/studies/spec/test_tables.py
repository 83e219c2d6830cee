import pytest

from nested_agents.core.plugins.models import kind_of, models_of
from nested_agents.scenarios.box_pushing.world.settings import Failure
from nested_agents.studies.spec.tables import assignment, flat, merge, nested, override


def test_neither_table_is_modified():
    base, table = {"a": {"b": 1}}, {"a": {"c": 2}}
    assert merge(base, table) == {"a": {"b": 1, "c": 2}}
    assert (base, table) == ({"a": {"b": 1}}, {"a": {"c": 2}})


def test_a_table_replaces_a_value_and_a_value_a_table():
    assert merge({"a": 1}, {"a": {"b": 2}}) == {"a": {"b": 2}}
    assert merge({"a": {"b": 2}}, {"a": 1}) == {"a": 1}


def test_another_kind_replaces_its_table():
    base = {"kind": "td-lambda", "trace_decay": 0.4, "discount": 0.9}
    assert override(base, {"kind": "frozen"}) == {"kind": "frozen"}
    inner = {"kind": "batch-td", "exploration": {"kind": "burst", "decay": 0.75}}
    table = {"exploration": {"kind": "paper"}}
    assert override(inner, table) == {"kind": "batch-td", "exploration": {"kind": "paper"}}


def test_the_same_kind_keeps_everything():
    base = {"kind": "td-lambda", "trace_decay": 0.4}
    table = {"kind": "td-lambda", "discount": 0.9}
    assert override(base, table) == base | table
    assert override(base, {"discount": 0.9}) == base | table


def test_every_member_of_a_union_has_a_kind():
    kinds = [kind_of(model) for model in models_of(Failure)]
    assert "seized" in kinds
    assert len(set(kinds)) == len(kinds)
    assert None not in kinds


def test_flat_undoes_nested():
    assert list(flat(nested("a.b.c", [1]))) == [("a.b.c", [1])]


@pytest.mark.parametrize(
    ("text", "table"),
    [
        ("episodes=3", {"episodes": 3}),
        ("learner.ridge = 0.5", {"learner": {"ridge": 0.5}}),
        ("scenario.box=circle", {"scenario": {"box": "circle"}}),
        ("topology=chain:reversed", {"topology": "chain:reversed"}),
        ('scenario.box="circle"', {"scenario": {"box": "circle"}}),
        ("seeds=[1, 2]", {"seeds": [1, 2]}),
        ('sweep."scenario.box"=["a"]', {"sweep": {"scenario.box": ["a"]}}),
        ("topology={kind='teams'}", {"topology": {"kind": "teams"}}),
        ("a=b=c", None),
        ("a", None),
        ("=3", None),
        ("a=", None),
        ("a b=3", None),
        ("a=[1", None),
        ("a=1\nb=2", None),
    ],
)
def test_assignment(text, table):
    if table is None:
        with pytest.raises(ValueError, match=r"expected|not valid TOML"):
            assignment(text)
    else:
        assert assignment(text) == table
