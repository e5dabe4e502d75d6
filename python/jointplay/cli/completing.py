"""What a shell offers after Tab: mechanism files, examples, keys of the file, sources."""

from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path
from typing import Any

import typer

from jointplay.basics.foreign import EXTENSIONS
from jointplay.errors import JointplayError


def files(incomplete: str) -> list[str]:
    """Mechanism files here and in the folders below; where there is none the shell offers all files itself."""
    return _found(incomplete, (".toml",))


def foreign(incomplete: str) -> list[str]:
    """The same of files that can be imported."""
    return _found(incomplete, (*EXTENSIONS, ".xml", ".json"))


def _found(incomplete: str, extensions: tuple[str, ...]) -> list[str]:
    """Files with one of these extensions."""
    folder, _, begin = incomplete.rpartition("/")
    base = Path(folder or ("/" if incomplete.startswith("/") else "."))
    found = [path for path in (*base.glob("*"), *base.glob("*/*")) if path.suffix.lower() in extensions]
    # As they are begun on the line, ./ and all.
    start = incomplete[: len(incomplete) - len(begin)]
    names = (f"{start}{path.relative_to(base).as_posix()}" for path in found)
    return sorted((name for name in names if name.startswith(incomplete)), key=lambda name: (name.count("/"), name))


def examples(incomplete: str) -> list[str]:
    """Names of the bundled examples."""
    from jointplay.examples import names

    return [name for name in names() if name.startswith(incomplete)]


def keys(ctx: typer.Context, incomplete: str) -> list[str]:
    """Keys of the file on the line, as `--set` takes them."""
    from jointplay.file import toml

    file = _file(ctx)
    with suppress(JointplayError, OSError, UnicodeDecodeError):
        data = toml.parse(Path(file).read_text(encoding="utf-8"), file=file)
        return [f"{key}=" for key in _dotted(data) if key.startswith(incomplete)]
    return []


def offsets(ctx: typer.Context, incomplete: str) -> list[str]:
    """Sources and parameters of the file on the line, as `--offset` takes them."""
    from jointplay.model.mechanism import load

    with suppress(JointplayError, OSError):
        m = load(_file(ctx))
        return [f"{name}=" for name in dict.fromkeys((*m.sources, *m.parameters)) if name.startswith(incomplete)]
    return []


def _file(ctx: typer.Context) -> str:
    """The mechanism file on the line; an option without its value yet leaves it among the rest."""
    named = [ctx.params.get(name) for name in ("file", "first")]
    return str(next((name for name in (*named, *ctx.args) if name), ""))


def _dotted(value: Any, before: str = "") -> Iterator[str]:
    """Every key of tables in tables; entries of lists by their number."""
    entries = value.items() if isinstance(value, dict) else enumerate(value)
    for key, inner in entries:
        name = f"{before}{key}"
        if isinstance(inner, dict) or (isinstance(inner, list) and any(isinstance(one, dict) for one in inner)):
            yield from _dotted(inner, f"{name}.")
        else:
            yield name
