"""Runs of one mechanism: by other views, settings, analyses; kept by name, so that checks share them."""

import os
import subprocess
import warnings
from pathlib import Path

import numpy as np
import yaml

from . import commands, generator
from .builder import Builder, View


class Run:
    """Rows of probes of one analysis, in the units of the view that it was run by."""

    def __init__(self, analysis, builder: Builder):
        self.builder = builder
        self.time = np.array(analysis.time)
        self.events = list(analysis.events)
        self.warnings = list(analysis.warnings)
        self.statistics = dict(analysis.statistics)
        self.q, self.u = np.array(analysis.q), np.array(analysis.u)
        self._rows = {name: np.array(analysis[name]) for name in analysis}

    def __getitem__(self, probe: str) -> np.ndarray:
        return self._rows[probe]

    def __contains__(self, probe: str) -> bool:
        return probe in self._rows

    def __iter__(self):
        return iter(self._rows)

    def nominal(self, probe: str) -> np.ndarray:
        """Rows of a probe in the units of the nominal mechanism, n×columns."""
        quantity = self.builder.quantities[probe]
        rows = self._rows[probe] / self.builder.view.unit(quantity.mass, quantity.length)
        return rows.reshape(len(self.time), -1)


class _Dumper(yaml.SafeDumper):
    """Lists and maps without further ones in one line, no anchors."""

    def ignore_aliases(self, data):
        return True


class Case:
    """A mechanism of (seed, index), and the runs that have been made of it."""

    def __init__(self, seed: int, index: int, folder: Path):
        self.seed, self.index, self.folder = seed, index, folder
        self.builder = generator.make(seed, index)
        self.facts = self.builder.facts
        self._runs = {}

    def write(self, tag: str, builder: Builder = None, change=None) -> Path:
        """Writes a model file. @param change  called with its keys"""
        keys = (builder or self.builder).to_dict()
        if change:
            change(keys)
        path = self.folder / f"{tag}.yaml"
        path.write_text(yaml.dump(keys, Dumper=_Dumper, sort_keys=False, default_flow_style=None, width=130))
        return path

    def run(self, tag: str, view: View = None, change=None) -> Run:
        """The analysis `run`, done once for each tag."""
        if tag not in self._runs:
            builder = generator.make(self.seed, self.index, view) if view else self.builder
            results = run_file(self.write(tag, builder, change), self.folder / f"{tag}.h5", ["run"])
            self._runs[tag] = Run(results["run"], builder)
        return self._runs[tag]


def run_file(path: Path, output: Path, analyses=(), **more):
    """Runs a model file; its warnings stay with its results."""
    import simflex

    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        return simflex.Model(path).run(output, list(analyses), **more)


def run_program(*arguments, folder: Path) -> subprocess.CompletedProcess:
    """The program `simflex`, which SIMFLEX_PROGRAM names."""
    return commands.call([os.environ["SIMFLEX_PROGRAM"], *map(str, arguments)], folder, {})
