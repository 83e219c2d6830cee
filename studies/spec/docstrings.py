"""Docstrings of the fields of settings, which document the keys of a spec."""

import ast
import inspect
from collections.abc import Mapping
from functools import cache
from itertools import pairwise
from textwrap import dedent

from pydantic import BaseModel


def field_docstring(model: type[BaseModel], field: str) -> str:
    """Return the docstring of a field in one line; empty if it has none."""
    declaring = (cls for cls in model.__mro__ if field in inspect.get_annotations(cls))
    written = _docstrings(next(declaring, model)).get(field)
    return " ".join((model.model_fields[field].description or written or "").split())


@cache
def _docstrings(cls: type) -> Mapping[str, str]:
    """Return the docstrings of the fields that a class declares.

    With its option ``use_attribute_docstrings`` pydantic reads them at every import: 0.4 s for the
    models of this package, in each process.
    """
    try:
        source = inspect.getsource(cls)
    except (OSError, TypeError):
        return {}
    (definition,) = ast.parse(dedent(source)).body
    body = definition.body if isinstance(definition, ast.ClassDef) else []
    return {
        field.target.id: str(text.value.value)
        for field, text in pairwise(body)
        if isinstance(field, ast.AnnAssign) and isinstance(field.target, ast.Name)
        if isinstance(text, ast.Expr) and isinstance(text.value, ast.Constant)
    }
