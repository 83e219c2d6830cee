"""What Python text means is the same under every version of Python."""

import hashlib

import pytest

from nested_agents.core.plugins.syntax import tree_text

TEXT = '''
"""A world."""
from __future__ import annotations

class World(Base, kind="arm"):
    links: int = 3

    async def step(self, /, joint, *rest, **more) -> None:
        """
        Indented.
        """
        print(f"{joint!r:>{self.links}} {rest:{more}.{rest}f}{joint:}", u"x", 1e400, -0.0, end="")

def empty(): pass
call = lambda: [{**{}}, *()]
'''


def test_a_tree_is_what_python_3_11_writes():
    digest = hashlib.sha256(tree_text(TEXT, "world.py").encode()).hexdigest()
    assert digest == "2364c1fc21969180ac7e32f5a8cb08d5cfc01f2a2d1ee415921b8e27871593aa"


def test_small_trees_by_hand():
    assert tree_text("f'{a:{b}}'", "a.py") == (
        "Module(body=[Expr(value=JoinedStr(values=[FormattedValue(value=Name(id='a', ctx=Load()), "
        "conversion=-1, format_spec=JoinedStr(values=[FormattedValue(value=Name(id='b', "
        "ctx=Load()), conversion=-1)]))]))], type_ignores=[])"
    )
    assert tree_text("class A: pass", "a.py") == (
        "Module(body=[ClassDef(name='A', bases=[], keywords=[], body=[Pass()], "
        "decorator_list=[])], type_ignores=[])"
    )


def test_what_is_no_python_names_its_file():
    with pytest.raises(SyntaxError, match=r"a\.py, line 1"):
        tree_text("class", "a.py")
