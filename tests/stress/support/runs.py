"""Runs of one mechanism with other views, settings and analyses. They are kept by name, so that checks share them."""

import os
import subprocess
import warnings
from pathlib import Path

import numpy as np
import yaml

from . import commands, generator
from .builder import Builder, View


class Run:
    """Rows of the probes of one analysis, in the units of its view."""

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
        """Rows of a probe in the units of the nominal mechanism (n×columns)."""
        quantity = self.builder.quantities[probe]
        rows = self._rows[probe] / self.builder.view.unit(quantity.mass, quantity.length)
        return rows.reshape(len(self.time), -1)


class _Dumper(yaml.SafeDumper):
    """Writes lists and maps without nested ones on one line, and no anchors."""

    def ignore_aliases(self, data):
        return True


class Case:
    """The mechanism of (seed, index), and the runs made of it so far."""

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
        """Results of the analysis `run`, which is done once for each tag."""
        if tag not in self._runs:
            builder = generator.make(self.seed, self.index, view) if view else self.builder
            results = run_file(self.write(tag, builder, change), self.folder / f"{tag}.h5", ["run"])
            self._runs[tag] = Run(results["run"], builder)
        return self._runs[tag]


def run_file(path: Path, output: Path, analyses=(), **more):
    """Runs a model file. Warnings are kept only in the results."""
    import simflex

    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        return simflex.Model(path).run(output, list(analyses), **more)


def run_program(*arguments, folder: Path) -> subprocess.CompletedProcess:
    """Runs the program `simflex`, which SIMFLEX_PROGRAM names."""
    return commands.call([os.environ["SIMFLEX_PROGRAM"], *map(str, arguments)], folder, {})
