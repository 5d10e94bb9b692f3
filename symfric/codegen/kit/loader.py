"""The ctypes loader of a kit: one file of Python that needs NumPy and a C compiler, no symfric."""

from collections.abc import Sequence

from symfric.codegen.blocks.block import GROUPS, Block
from symfric.codegen.writing.layout import members, prefix
from symfric.codegen.writing.text import banner
from symfric.emitter.c99 import Real

LOADER = '''\
"""{title}

    from {module} import Block
    block = Block()                       # {type_doc}
{example}

The shared library is opened where it lies beside this file ({name}.so, .dylib or .dll, made by
CMake, for example), else the C is compiled by $CC or cc, into a temporary folder.

{banner}
"""

import ctypes
import os
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np

NAME = {name!r}
MODEL = {fingerprint!r}
HERE = Path(__file__).resolve().parent
TYPES = {types!r}
"""Floating point type -> stem of the names in C."""

# Members of the structs in C: name and, for an array, how many numbers, else 0.
MEMBERS = {{
{members}}}
INPUTS = {inputs!r}
OUTPUTS = {outputs!r}
IS_FUNCTION = {is_function!r}
HAS_STATUS = {guards!r}
RESETS = {resets!r}


def library():
    """The shared library, opened or compiled."""
    ending = {{"darwin": ".dylib", "win32": ".dll"}}.get(sys.platform, ".so")
    built = HERE / f"{{NAME}}{{ending}}"
    if built.is_file():
        return ctypes.CDLL(str(built))
    compiler = os.environ.get("CC") or next(
        (c for c in ("cc", "gcc", "clang") if shutil.which(c)), None
    )
    if compiler is None:
        raise OSError(f"expected {{built.name}} beside this file or a C compiler, got neither")
    sources = [str(HERE / f"{{stem}}.c") for stem in TYPES.values()]
    target = Path(tempfile.mkdtemp(prefix=f"{{NAME}}-")) / built.name
    flags = ["-std=c99", "-O2", "-ffp-contract=off", "-shared", "-fPIC"]
    subprocess.run([*compiler.split(), *flags, *sources, "-o", str(target), "-lm"], check=True)
    return ctypes.CDLL(str(target))


class Block:
    """One instance: its state and its parameters, which may be changed between steps.

    Args:
        real: {reals}.
        start: states that do not begin at their start values, by name.
        parameters: those that have not their defaults, by name.
    """

    _library = None

    def __init__(self, real={first!r}, start=None, **parameters):
        if real not in TYPES:
            raise ValueError(f"real: expected one of {{', '.join(TYPES)}}, got {{real}}")
        Block._library = Block._library or library()
        self.real, self.stem = real, TYPES[real]
        self.number = ctypes.c_double if real == "double" else ctypes.c_float
        self.structs = {{group: self._struct(group) for group in MEMBERS}}
        self.status = 0
        if "param" in MEMBERS:
            self.param = self._copy("param", "default")
            self._fill(self.param, parameters)
        elif parameters:
            raise ValueError(f"expected no parameters, got {{', '.join(parameters)}}")
        if "state" in MEMBERS:
            self.reset(start)

    def _struct(self, group):
        fields = [(n, self.number * size if size else self.number) for n, size in MEMBERS[group]]
        return type(f"{{self.stem}}_{{group}}_t", (ctypes.Structure,), {{"_fields_": fields}})

    def _copy(self, group, constant):
        """A copy of a constant struct of the library."""
        kind = self.structs[group]
        return kind.from_buffer_copy(kind.in_dll(Block._library, f"{{self.stem}}_{{constant}}"))

    def _fill(self, struct, values):
        for name, value in dict(values).items():
            if name not in dict(struct._fields_):
                known = ", ".join(n for n, _ in struct._fields_)
                raise ValueError(f"expected one of {{known}}, got {{name}}")
            kind = dict(struct._fields_)[name]
            size = getattr(kind, "_length_", 0)
            if np.shape(value) != ((size,) if size else ()):
                raise ValueError(f"{{name}}: expected {{size or 'one'}} number(s), got {{value}}")
            setattr(struct, name, kind(*value) if size else kind(value))

    def reset(self, start=None):
        """Begin anew, from the start values of the model or from others, by name."""
        begin = self._copy("state", "start")
        self._fill(begin, start or {{}})
        self.state = self.structs["state"]()
        call = getattr(Block._library, f"{{self.stem}}_init")
        call.restype = None
        call(ctypes.byref(self.state), ctypes.byref(begin))

    def start_by(self, reset, **inputs):
        """Begin by another initialisation of the C, such as init_sliding, at the inputs."""
        if reset not in RESETS:
            raise ValueError(f"expected one of {{', '.join(RESETS)}}, got {{reset}}")
        given = self.structs["in"]()
        self._fill(given, inputs)
        groups = {{"state": self.state, "param": getattr(self, "param", None), "in": given}}
        call = getattr(Block._library, f"{{self.stem}}_{{reset}}")
        call.restype = None
        call(*(ctypes.byref(struct) for group, struct in groups.items() if group in MEMBERS))

    def step(self, **inputs):
        """One step: the outputs by name. What the guards did is then in `status`."""
        result = self.run(**inputs)
        return {{name: values[0].tolist() for name, values in result.items()}}

    def run(self, steps=1, **inputs):
        """A step for each number in the arrays of inputs: arrays of outputs by name, and status.

        What is an array in C is one here, too: q of shape (size,) or (steps, size), or q_1, q_2 ...
        """
        inputs = self._each(inputs)
        missing = [n for n in INPUTS if n not in inputs]
        if missing or len(inputs) > len(INPUTS):
            given = ", ".join(inputs) or "none"
            raise ValueError(f"expected the inputs {{', '.join(INPUTS)}}, got {{given}}")
        columns = [np.atleast_1d(np.asarray(inputs[n], float)) for n in INPUTS]
        count = np.broadcast_shapes(*(c.shape for c in columns), (steps,))[0]
        columns = [np.broadcast_to(c, count) for c in columns]
        rows = np.column_stack([np.zeros((count, 0)), *columns])
        found, status = np.zeros((count, len(OUTPUTS))), np.zeros(count, int)
        once = self._function if IS_FUNCTION else self._step
        for k, row in enumerate(rows.tolist()):
            found[k], status[k] = once(row)
        self.status = int(np.bitwise_or.reduce(status, initial=0))
        result = {{name: found[:, i] for i, name in enumerate(OUTPUTS)}}
        result |= {{name: found[:, rows] for name, rows in self._arrays("out")}}
        return result | ({{"status": status}} if HAS_STATUS else {{}})

    def _arrays(self, group):
        """Arrays of a struct and which of its numbers they hold."""
        first = 0
        for name, size in MEMBERS.get(group, ()):
            if size:
                yield name, slice(first, first + size)
            first += size or 1

    def _each(self, inputs):
        """Inputs with arrays taken apart."""
        single = dict(inputs)
        for name, rows in self._arrays("in"):
            if name in single:
                own, values = INPUTS[rows], np.asarray(single.pop(name), float)
                if values.shape[-1:] != (len(own),):
                    raise ValueError(f"{{name}}: expected {{len(own)}} numbers, got {{values}}")
                single |= dict(zip(own, values.T))
        return single

    def _step(self, row):
        call = getattr(Block._library, f"{{self.stem}}_step")
        call.restype = ctypes.c_uint if HAS_STATUS else None
        structs = {{g: kind() for g, kind in self.structs.items() if g in ("in", "out")}}
        if "in" in structs:
            numbers = (self.number * len(row)).from_buffer(structs["in"])
            numbers[:] = row
        structs |= {{g: getattr(self, g) for g in ("state", "param") if g in MEMBERS}}
        said = call(*(ctypes.byref(structs[g]) for g in {groups!r} if g in structs))
        if "out" not in structs:
            return [], said or 0
        return (self.number * len(OUTPUTS)).from_buffer(structs["out"]), said or 0

    def _function(self, row):
        call, status = getattr(Block._library, self.stem), ctypes.c_uint(0)
        call.restype = self.number
        arguments = [self.number(x) for x in row]
        arguments += [ctypes.byref(self.param)] if "param" in MEMBERS else []
        arguments += [ctypes.byref(status)] if HAS_STATUS else []
        return [call(*arguments)], status.value
'''


def loader(block: Block, reals: Sequence[Real], guards: bool) -> str:
    """Text of NAME_ctypes.py: class `Block` with `step`, `run` on arrays and `reset`."""
    types = {real.name: prefix(block, real) for real in reals}
    layout = {
        group: [(member.name, member.size) for member in rows]
        for group, rows in members(block).items()
    }
    given = ", ".join(f"{v.name}={v.nominal:g}" for v in block.inputs)
    shown = next(iter(block.outputs), None)
    example = f"    block.step({given})" + (f'["{shown}"]' if shown else "")
    first, *rest = banner(block, f"{block.name}_ctypes.py")
    return LOADER.format(
        title=f"{block.name} from Python: the generated C, by ctypes and NumPy.",
        module=f"{block.name}_ctypes",
        name=block.name,
        fingerprint=block.fingerprint,
        banner="\n".join([first.replace("C99 made", "made"), *rest]),
        type_doc=" or ".join(f'Block("{name}")' for name in types),
        reals=" or ".join(types),
        first=next(iter(types)),
        example=example,
        types=types,
        members="".join(f"    {group!r}: {rows!r},\n" for group, rows in layout.items()),
        inputs=tuple(v.name for v in block.inputs),
        outputs=tuple(block.outputs),
        is_function=block.is_function,
        guards=guards,
        resets=tuple(block.resets),
        groups=GROUPS,
    )
