"""``croissant``: metadata of a folder of Parquet files in the format Croissant 1.1, a JSON-LD document."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping
from datetime import UTC, datetime
from pathlib import Path
from typing import Any, Final

from flockesc_env._core import __version__

AUTHORS: Final = "The flockesc_env authors"
KEYS: Final = ("policy", "seed", "step", "agent")
"""Columns that identify a row."""

TITLE: Final = "flockesc_env: environments whose action is the interaction range of a flock under attack"

_TERMS = (
    *("arrayShape", "citeAs", "column", "containedIn", "equivalentProperty", "extract", "field"),
    *("fileObject", "fileProperty", "fileSet", "format", "includes", "isArray", "isLiveDataset"),
    *("jsonPath", "key", "md5", "parentField", "path", "recordSet", "references", "regex", "repeated"),
    *("replace", "samplingRate", "separator", "source", "subField", "transform"),
)
_CONTEXT: Final = {
    "@language": "en",
    "@vocab": "https://schema.org/",
    "sc": "https://schema.org/",
    "cr": "http://mlcommons.org/croissant/",
    "rai": "http://mlcommons.org/croissant/RAI/",
    "dct": "http://purl.org/dc/terms/",
    "conformsTo": "dct:conformsTo",
    "dataType": {"@id": "cr:dataType", "@type": "@vocab"},
    **{term: {"@container": "@language"} for term in ("description", "name")},
    **{term: {"@id": f"cr:{term}", "@type": "@json"} for term in ("data", "examples")},
    **{term: f"cr:{term}" for term in _TERMS},
}
"""The context that Croissant 1.1 prescribes."""


def croissant(
    folder: Path, name: str, description: str, tables: Mapping[str, str], columns: Mapping[str, str]
) -> dict[str, Any]:
    """Return the metadata: files with checksums, and a record set per file.

    Args:
        folder: a folder of Parquet files.
        name: name of the data set.
        description: description of the data set.
        tables: description of every file, by its name without the suffix.
        columns: description of every column, by its name.
    """
    files = [folder / f"{table}.parquet" for table in tables]
    return {
        "@context": _CONTEXT,
        "@type": "sc:Dataset",
        "conformsTo": "http://mlcommons.org/croissant/1.1",
        "name": name,
        "description": description,
        "version": __version__,
        "license": "https://spdx.org/licenses/MIT",
        "creator": {"@type": "sc:Organization", "name": AUTHORS},
        "datePublished": datetime.now(UTC).date().isoformat(),
        "citeAs": f"@misc{{flockesc_env, author = {{{{{AUTHORS}}}}}, title = {{{{{TITLE}}}}},"
        f" note = {{Version {__version__}}}}}",
        "distribution": [_file(path) for path in files],
        "recordSet": [_record_set(path, tables[path.stem], columns) for path in files],
    }


def _file(path: Path) -> dict[str, Any]:
    with path.open("rb") as file:
        sha256 = hashlib.file_digest(file, "sha256").hexdigest()
    return {
        "@type": "cr:FileObject",
        "@id": path.name,
        "name": path.name,
        "contentUrl": path.name,
        "contentSize": f"{path.stat().st_size} B",
        "encodingFormat": "application/x-parquet",
        "sha256": sha256,
    }


def _record_set(path: Path, description: str, columns: Mapping[str, str]) -> dict[str, Any]:
    import polars as pl

    fields = []
    for column, dtype in pl.read_parquet_schema(path).items():
        kind, array = str(dtype), {}
        if isinstance(dtype, pl.Array | pl.List):
            kind = str(dtype.inner)
            width = dtype.size if isinstance(dtype, pl.Array) else -1
            array = {"isArray": True, "arrayShape": str(width)}
        fields.append(
            {
                "@type": "cr:Field",
                "@id": f"{path.stem}/{column}",
                "name": column,
                "description": columns[column],
                "dataType": {"String": "sc:Text", "Boolean": "sc:Boolean"}.get(kind, f"cr:{kind}"),
                **array,
                "source": {"fileObject": {"@id": path.name}, "extract": {"column": column}},
            }
        )
    return {
        "@type": "cr:RecordSet",
        "@id": path.stem,
        "name": path.stem,
        "description": description,
        "key": [{"@id": field["@id"]} for field in fields if field["name"] in KEYS],
        "field": fields,
    }
