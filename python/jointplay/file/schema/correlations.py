"""Sources that scatter together, by the correlation of their ranks."""

from typing import Annotated, ClassVar, Self

from pydantic import ConfigDict, Field, model_validator

from .values import EXPRESSION, Omittable, Table, omitted, problem

#: more sources than one batch has to do with
MOST_SOURCES = 200

Rank = Annotated[float, Field(ge=-1.0, le=1.0), EXPRESSION]
Row = Annotated[tuple[Rank, ...], Field(strict=False)]


class Correlation(Table):
    """Sources that scatter together, such as three holes of one reamer."""

    model_config = ConfigDict(json_schema_extra={"oneOf": [{"required": ["rank"]}, {"required": ["ranks"]}]})
    example: ClassVar[str] = '{ sources = ["J1.hole", "J2.hole"], rank = 0.8 }'

    sources: Annotated[tuple[str, ...], Field(strict=False, min_length=2, max_length=MOST_SOURCES)] = Field(
        description="names of sizes, dimensions, angles, ratio errors and drive errors"
    )
    rank: Omittable[Rank] = omitted("rank correlation of every two of them")
    ranks: Omittable[Annotated[tuple[Row, ...], Field(strict=False)]] = omitted(
        "instead of rank: the matrix of rank correlations, row by row"
    )

    @model_validator(mode="after")
    def _one_form(self) -> Self:
        if (self.rank is None) == (self.ranks is None):
            raise problem("give rank, or the matrix ranks; one of them")
        n = len(self.sources)
        if len(set(self.sources)) < n:
            twice = next(name for name in self.sources if self.sources.count(name) > 1)
            raise problem(f"'{twice}' is named twice")
        if self.ranks is not None:
            if len(self.ranks) != n or any(len(row) != n for row in self.ranks):
                raise problem(f"ranks needs {n} rows of {n} numbers, one for each of the sources")
            for i, row in enumerate(self.ranks):
                if row[i] != 1.0:
                    raise problem(f"row {i + 1} of ranks: a source has the rank correlation 1 with itself")
                if any(row[j] != self.ranks[j][i] for j in range(i)):
                    raise problem(f"row {i + 1} of ranks is not the same as its column: the matrix is symmetric")
        return self

    @property
    def matrix(self) -> list[list[float]]:
        """Rank correlations of all pairs."""
        n = len(self.sources)
        if self.ranks is not None:
            return [list(row) for row in self.ranks]
        assert self.rank is not None
        return [[1.0 if i == j else self.rank for j in range(n)] for i in range(n)]
