"""Registries: names, files, entry points and objects; whatever cannot be is refused in one line."""

import sys
from importlib import metadata
from importlib.metadata import EntryPoint
from pathlib import Path
from types import ModuleType
from typing import Annotated

import pytest

from nested_agents.core.hierarchy.hierarchy import Hierarchy
from nested_agents.core.plugins.models import Plugged
from nested_agents.core.plugins.registry import Registry, SettingsRegistry
from nested_agents.core.plugins.settings import PartSettings, Settings, SettingsError
from nested_agents.core.plugins.sources import Sources

CARTS = """
from nested_agents.core.plugins.settings import Settings
from tests_registry_base import CartSettings

class Cart:
    class Settings(CartSettings):
        wheels: int = 2

    def __init__(self, settings, color):
        self.wheels, self.load, self.color = settings.wheels, settings.load, color

def made(color, *, load: float = 1.0):
    return "made", color, load

class Bare:
    def __init__(self, settings, color):
        self.color = color

class Greedy:
    class Settings(CartSettings):
        pass

    def __init__(self, settings, color, load):
        self.color = color

class Foreign:
    class Settings(Settings):
        wheels: int = 2

class Built(CartSettings):
    def build(self, color):
        return self.load, color

NUMBER = 3
"""


class CartSettings(PartSettings):
    load: float = 1.0


class RailSettings(CartSettings):
    kind: str = "rail"

    def build(self, color: str) -> object:
        return "rail", color


@pytest.fixture
def carts(monkeypatch: pytest.MonkeyPatch) -> SettingsRegistry:
    base = ModuleType("tests_registry_base")
    base.CartSettings, base.RailSettings = CartSettings, RailSettings  # type: ignore[attr-defined]
    monkeypatch.setitem(sys.modules, base.__name__, base)
    return SettingsRegistry("cart", {"rail": "tests_registry_base:RailSettings"}, CartSettings)


@pytest.fixture
def offered(monkeypatch: pytest.MonkeyPatch) -> list[EntryPoint]:
    points: list[EntryPoint] = []
    monkeypatch.setattr(
        metadata, "entry_points", lambda group: [p for p in points if p.group == group]
    )
    return points


def test_what_is_installed_is_found_by_name(offered: list[EntryPoint]) -> None:
    numbers = Registry("number", {"pi": "math:pi"})
    offered.append(EntryPoint("e", "math:e", "nested_agents.numbers"))
    offered.append(EntryPoint("tau", "math:tau", "nested_agents.letters"))
    assert numbers.names() == ["pi", "e"]
    assert numbers.find("e") == pytest.approx(2.718281828459045)


@pytest.mark.parametrize("names", [["pi"], ["e", "e"]])
def test_a_name_that_is_offered_twice_is_refused(
    names: list[str], offered: list[EntryPoint]
) -> None:
    numbers = Registry("number", {"pi": "math:pi"})
    for k, name in enumerate(names):
        offered.append(EntryPoint(name, f"mine:{name}{k}", "nested_agents.numbers"))
    with pytest.raises(ValueError, match=rf"^'{names[0]}' is offered twice: \S+, mine:"):
        numbers.names()


def test_an_unknown_name_gets_the_nearest(carts: SettingsRegistry) -> None:
    said = r"^did you mean 'rail'\? known: rail, or one of your own as file\.py:NAME$"
    with pytest.raises(ValueError, match=said):
        carts.parsed("rial")
    with pytest.raises(ValueError, match=r"^known: rail, or"):
        carts.parsed("xyz")


def test_what_an_installed_package_fails_with_is_told(offered: list[EntryPoint]) -> None:
    offered.append(EntryPoint("odd", "no_such_thing:Odd", "nested_agents.numbers"))
    with pytest.raises(ValueError, match=r"^cannot be loaded: ModuleNotFoundError"):
        Registry("number", {}).find("odd")


@pytest.mark.parametrize(
    ("name", "settings", "expected"),
    [
        ("made", {"load": 2.0}, ("made", "red", 2.0)),
        ("Built", {"load": 2.0}, (2.0, "red")),
    ],
)
def test_what_a_file_may_hold(
    name: str, settings: dict, expected: object, carts: SettingsRegistry
) -> None:
    with Sources(texts={"mine.py": CARTS}).active():
        model = carts.model(f"mine.py:{name}")
        found = model(**settings).build("red")
        assert found == expected
        assert model().kind == f"mine.py:{name}"
        assert carts.model(f"mine.py:{name}") is model


def test_a_class_with_settings_of_its_own_gets_them(carts: SettingsRegistry) -> None:
    with Sources(texts={"mine.py": CARTS}).active():
        model = carts.model("mine.py:Cart")
        cart = model(wheels=4).build("red")
        assert (cart.wheels, cart.load, cart.color) == (4, 1.0, "red")
        with pytest.raises(SettingsError, match="legs = 2: unknown key"):
            model(legs=2)


@pytest.mark.parametrize(
    ("name", "complaint"),
    [
        ("Foreign", r"^is no cart: it needs a class Settings that inherits \S+\.CartSettings$"),
        ("Bare", r"^is no cart: it needs a class Settings that inherits \S+\.CartSettings$"),
        ("NUMBER", r"^is of type int, allowed: cart$"),
    ],
)
def test_what_is_no_cart_is_refused(name: str, complaint: str, carts: SettingsRegistry) -> None:
    with (
        Sources(texts={"mine.py": CARTS}).active(),
        pytest.raises(ValueError, match=complaint),
    ):
        carts.model(f"mine.py:{name}")


def test_a_class_that_takes_other_arguments_is_refused(carts: SettingsRegistry) -> None:
    with Sources(texts={"mine.py": CARTS}).active():
        model = carts.model("mine.py:Greedy")
        said = r"^cart 'mine\.py:Greedy': missing a required argument: 'load'$"
        with pytest.raises(ValueError, match=said):
            model().build("red")


def test_a_plugged_field_takes_names_tables_and_settings(carts: SettingsRegistry) -> None:
    class Shop(Settings):
        cart: Annotated[CartSettings, Plugged(carts, carts.parsed)] = RailSettings()

    with Sources(texts={"mine.py": CARTS}).active():
        assert Shop.model_validate({"cart": "rail"}).cart.build("red") == ("rail", "red")
        table = {"kind": "mine.py:Cart", "wheels": 3}
        shop = Shop.model_validate({"cart": table})
        assert shop.model_dump(mode="json")["cart"] == table | {"load": 1.0}
        assert Shop(cart=shop.cart) == shop
        for bad, complaint in (
            ({"kind": "rial"}, "did you mean 'rail'"),
            ({"wheels": 3}, r"cart\.wheels"),
            ({"kind": "rail", "load": "2"}, "valid number"),
            (3, "must be a name or a table"),
        ):
            with pytest.raises(ValueError, match=complaint):
                Shop.model_validate({"cart": bad})


def module_of(monkeypatch: pytest.MonkeyPatch, name: str, path: Path | None, text: str) -> object:
    """Return `Thing` of a module that has been imported from a file, or made up."""
    module = ModuleType(name)
    if path is not None:
        path.write_text(text)
        module.__file__ = str(path)
    monkeypatch.setitem(sys.modules, name, module)
    exec(text, module.__dict__)
    return module.__dict__["Thing"]


def test_an_object_becomes_the_name_of_its_place(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    things = Registry("thing", {"hierarchy": "nested_agents.core.hierarchy.hierarchy:Hierarchy"})
    monkeypatch.chdir(tmp_path)
    text = "class Thing:\n    pass\n"
    inside = module_of(monkeypatch, "inside", tmp_path / "inside.py", text)
    assert things.reference_to(inside) == "inside.py:Thing"
    with Sources(tmp_path).active():
        found = things.find("inside.py:Thing")
        assert things.reference_to(found) == "inside.py:Thing"
    monkeypatch.chdir("/")
    outside = things.reference_to(inside)
    assert outside.endswith("inside.py:Thing")
    assert things.reference_to(Hierarchy) == "hierarchy"
    assert things.reference_to(Sources) == "nested_agents.core.plugins.sources:Sources"
    assert things.find("nested_agents.core.plugins.sources:Sources") is Sources


def test_an_object_without_a_place_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    things = Registry("thing", {})
    typed = module_of(monkeypatch, "__console__", None, "class Thing:\n    pass\n")
    with pytest.raises(
        ValueError, match=r"^Thing is defined in an interactive session; save it to a file$"
    ):
        things.reference_to(typed)
    for nameless in (lambda: None, 3):
        with pytest.raises(ValueError, match="is not defined at the top level of a file"):
            things.reference_to(nameless)


@pytest.mark.parametrize(
    ("table", "complaint"),
    [
        ({"wheel": 3}, "CartSettings: wheel = 3: unknown key; known: kind, load"),
        ({"load": "much"}, "CartSettings: load = 'much': must be a number"),
    ],
)
def test_settings_made_in_python_refuse_in_one_line(table: dict, complaint: str) -> None:
    with pytest.raises(SettingsError) as refusal:
        CartSettings(**table)
    assert str(refusal.value).startswith(complaint)
    assert "\n" not in str(refusal.value)
