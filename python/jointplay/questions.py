"""What a mechanism can be asked: one declaration for each question.

Commands and their help, maps, sweeps, sentences, tables, figures, the report and the studio follow from it. A question
is computed in `analyses`, in the module of its name, and its options are the arguments of the function of its name
there. Functions of higher layers are named as `module.function` of that layer: a declaration imports nothing, because a
command has to start fast.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from importlib import import_module
from types import MappingProxyType
from typing import Any

from .errors import InputError, not_known

#: where nobody says it: random specimens, a power of two, of which scrambled Sobol points are best; and parts of the
#: sets that are expanded at most for each certified bound
SAMPLES, PARTS = 131_072, 100
#: by who asks, the options that they give themselves
Askers = Mapping[str, Mapping[str, Any]]


@dataclass(frozen=True)
class Figure:
    """A number of every configuration by which answers are compared."""

    #: what it is made of: the size of its components, or its typical quantile
    variable: str
    #: what sweeps and comparisons call it
    words: str


def _sizes(position: str, rotation: str, words: str = "{}") -> Mapping[str, Figure]:
    """The position and the rotation of an error."""
    return {
        "position": Figure(position, words.format("position error")),
        "rotation": Figure(rotation, words.format("rotation")),
    }


@dataclass(frozen=True)
class Question:
    """A question; functions of higher layers are named."""

    name: str
    #: of its table
    title: str = ""
    #: what pages call it
    label: str = ""
    #: where limits hold, as the end of a sentence (``{}`` is the required yield); only of what is judged together
    judged: str = ""
    #: what its verdict assumes, as the end of a sentence
    assumes: str = ""
    #: where pages draw the mechanism
    displaced: str = ""
    #: by quantity, the most telling one first
    figures: Mapping[str, Figure] = field(default_factory=dict)
    #: whether the limits of errors are those that it keeps to
    is_of_errors: bool = False
    #: who may ask it, with the options that they give themselves
    asked_by: Askers = field(default_factory=dict)
    #: whether there is an answer only where something loads the mechanism
    needs_loads: bool = False
    #: the same of a target of the output
    needs_target: bool = False
    #: nodes of a map that are computed at a time: some seconds of work, some ten megabytes
    chunk: int = 0
    #: in its module, what others ask, and the function with the options that they give, if it is not that of its name
    compute: str = "compute"
    options: str = ""
    #: of `conclusions`: says the answer in sentences; nothing where no command prints it
    conclusion: str = "errors.of_errors"
    #: of `table`: its columns over the configurations; or its tables, where they are not over the configurations
    table: str = "questions.of_error"
    overview: str = ""
    #: of `plot.panels`: what is drawn
    sheet: str = ""


def _by(*askers: str, **options: Mapping[str, Any]) -> Askers:
    """Those who ask a question, some with options of their own."""
    return {**dict.fromkeys(askers, MappingProxyType({})), **options}


_ERROR = _sizes("error", "error")
_NEARNESS = {"singular_value": Figure("singular_value", "smallest singular value")}
#: by name, in the order in which they are asked and listed
QUESTIONS: Mapping[str, Question] = {
    question.name: question
    for question in (
        Question(
            "loaded",
            title="Loaded: where the load pushes the output",
            label="under load",
            judged="under the load",
            is_of_errors=True,
            assumes="the loads of the file press every joint to its place; deviations are those that are known, "
            "without tolerances.",
            displaced="under load",
            figures=_ERROR,
            asked_by=_by(
                *("error", "sweep", "compare", "compensate", "forces", "studio"),
                # Where contacts change sides is seen from the offsets.
                map={"offset": True, "plays": False},
                # The rest decides nothing, and takes most of the time.
                allow={"details": False, "follows": False},
                design={"details": False, "follows": False},
                life={"details": False, "follows": False},
                workspace={"details": False, "follows": False},
            ),
            needs_loads=True,
            chunk=2**14,
            sheet="errors",
        ),
        Question(
            "worst",
            title="Worst case: the largest error that the clearances and tolerances allow",
            label="worst case",
            judged="in the worst case",
            is_of_errors=True,
            assumes="clearances, tolerances and drive errors take any values in their limits together, under any load; "
            "the largest error is the largest that ascents from many starts have found.",
            displaced="at the largest position error",
            figures=_sizes("worst_position", "worst_rotation", "largest {}"),
            asked_by=_by(
                *("error", "map", "sweep", "compare", "compensate", "allow", "life", "workspace", "allocate", "design"),
                *("assemble", "forces"),
                # While sliders move.
                studio={"exact": False},
            ),
            chunk=2**9,
            table="questions.of_worst",
            sheet="errors",
        ),
        Question(
            "random",
            title="Random: scatter of the error from specimen to specimen",
            label="random specimens",
            judged="in the required {} of the specimens",
            is_of_errors=True,
            assumes="tolerances, sizes and drive errors scatter by their laws, independently but for the correlations "
            "of the file; shares are counted in specimens, within the stated confidence.",
            figures=_sizes("error_quantile", "error_quantile", "95 % {}"),
            asked_by=_by(
                *("error", "sweep", "compare", "allocate", "assemble", "forces"),
                studio={"path": False},
                # The nodes of a grid are no path.
                map={"path": False},
                allow={"path": False, "probabilities": (), "follows": False},
                design={"path": False, "probabilities": (), "follows": False},
                life={"path": False, "follows": False},
                workspace={"path": False, "probabilities": (), "follows": False},
            ),
            chunk=2**6,
            table="questions.of_random",
            sheet="errors",
        ),
        Question(
            "given",
            title="Given offsets: error of the output",
            label="given offsets",
            judged="at the given offsets",
            is_of_errors=True,
            displaced="at the given offsets",
            figures=_ERROR,
            asked_by=_by("error", "map", "sweep", "compensate", "forces", "studio"),
            chunk=2**13,
            sheet="errors",
        ),
        Question(
            "structural",
            title="Structural error: the nominal mechanism beside what its output ought to do",
            label="structural error",
            assumes="the nominal mechanism, without clearances, tolerances and loads.",
            figures={"structural": Figure("structural_error", "structural error")},
            asked_by=_by("error", "map", "sweep"),
            needs_target=True,
            chunk=2**14,
            conclusion="errors.of_structural",
            table="questions.of_structural",
            sheet="structural",
        ),
        Question(
            "solve",
            title="Nominal output",
            figures=_NEARNESS,
            asked_by=_by("map", "sweep"),
            chunk=2**12,
            conclusion="motion.of_solve",
            table="questions.of_solve",
            sheet="poses",
        ),
        Question(
            "compensate",
            is_of_errors=True,
            title="Compensation: drives corrected",
            figures={
                "position": Figure("residual_position", "position after the correction"),
                "rotation": Figure("residual_rotation", "rotation after the correction"),
            },
            asked_by=_by("sweep", "compare"),
            compute="compute_corrected",
            options="corrected",
            conclusion="motion.of_compensate",
            table="questions.of_compensate",
            sheet="corrections",
        ),
        Question(
            "singularities",
            title="Singularities: the smallest singular values, and how far away along the path",
            figures=_NEARNESS,
            conclusion="motion.of_singularities",
            table="singularities.columns",
            sheet="nearness",
        ),
        Question("region", conclusion=""),
        Question(
            "forces",
            title="Forces with play: what is used of their limits",
            label="forces",
            judged="for forces",
            assumes="equilibrium without friction, at any offsets within clearances and tolerances; the extremes are "
            "those that ascents have found.",
            figures={"used": Figure("used", "used part of a force limit")},
            asked_by=_by("allow", "sweep", "map", "workspace"),
            chunk=2**9,
            compute="compute_limited",
            options="limited",
            conclusion="forces.of_forces",
            overview="forces.overview",
        ),
        Question("sensitivity", conclusion=""),
        Question("check", conclusion="building.of_check", overview="check.overview"),
        Question("allow", is_of_errors=True, conclusion="sizes.of_allow", overview="allow.overview", sheet="allowed"),
        Question("calibrate", conclusion="built.of_calibrate", overview="calibrate.overview", sheet="calibrated"),
        Question("plan", conclusion="built.of_plan", overview="calibrate.of_plan"),
        Question("diagnose", conclusion="built.of_diagnose", overview="calibrate.of_diagnose"),
        Question("verify", conclusion="built.of_verify", overview="calibrate.of_verify"),
        Question("life", is_of_errors=True, conclusion="wear.of_life", overview="life.overview", sheet="life"),
        Question(
            "workspace",
            is_of_errors=True,
            conclusion="workspace.of_workspace",
            overview="workspace.overview",
            sheet="workspace",
        ),
        Question(
            "allocate",
            is_of_errors=True,
            conclusion="sizes.of_allocate",
            overview="allocate.overview",
            sheet="allocated",
        ),
        Question("design", conclusion="dimensions.of_design", overview="design.overview", sheet="designed"),
        Question("assemble", conclusion="building.of_assemble", overview="assembly.overview"),
        # These ask others.
        Question("sweep", sheet="sweep"),
        Question("map"),
        Question("compare", sheet="comparison"),
    )
}


def asked_by(asker: str) -> tuple[str, ...]:
    """The questions that a command, or a page, may ask."""
    return tuple(name for name, question in QUESTIONS.items() if asker in question.asked_by)


def require_known(question: str, known: tuple[str, ...], what: str = "a question that can be asked here") -> None:
    """Refuse what is not asked here, by the names of what is."""
    if question not in known:
        raise InputError(not_known(str(question), what, known), key="question")


def named(package: str, dotted: str) -> Callable[..., Any]:
    """A function of a layer that a declaration names."""
    module, _, name = dotted.rpartition(".")
    return getattr(import_module(f"{package}.{module}"), name)  # type: ignore[no-any-return]
