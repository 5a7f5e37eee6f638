"""Tiny flexible parts that all cases share, reduced once: bars of bricks along x with the interfaces `near` and `far`."""

import dataclasses
import os
from pathlib import Path


@dataclasses.dataclass(frozen=True)
class Bar:
    name: str
    length: float  # [m] between the interfaces
    width: float  # [m] of the square section
    elements: int
    youngs_modulus: float  # [Pa]
    density: float  # [kg/m^3]
    stiffening: bool

    @property
    def mass(self) -> float:
        return self.density * self.width**2 * self.length


BARS = [Bar("soft", 0.5, 0.02, 6, 4e8, 1500, False), Bar("stiff", 0.3, 0.02, 4, 5e9, 2700, True)]


def write_deck(bar: Bar, path: Path) -> None:
    """Writes a deck of 8-node bricks in a row, centred on the x axis."""
    lines, near, far = ["*NODE"], [], []
    for i in range(bar.elements + 1):
        for z in range(2):
            for y in range(2):
                number = 1 + y + 2 * z + 4 * i
                near += [number] if i == 0 else []
                far += [number] if i == bar.elements else []
                place = (bar.length * i / bar.elements, (y - 0.5) * bar.width, (z - 0.5) * bar.width)
                lines.append(f"{number}, " + ", ".join(f"{x:.12g}" for x in place))
    lines.append(f"*ELEMENT, TYPE={'C3D8' if bar.stiffening else 'C3D8I'}, ELSET=ALL")
    for i in range(bar.elements):
        corners = [1 + 4 * (i + end) + y + 2 * z for z in range(2) for end, y in ((0, 0), (1, 0), (1, 1), (0, 1))]
        lines.append(f"{i + 1}, " + ", ".join(map(str, corners)))
    lines += [f"*NSET, NSET=NEAR\n{', '.join(map(str, near))}", f"*NSET, NSET=FAR\n{', '.join(map(str, far))}",
              "*MATERIAL, NAME=M", f"*ELASTIC\n{bar.youngs_modulus:g}, 0.3", f"*DENSITY\n{bar.density:g}",
              "*SOLID SECTION, ELSET=ALL, MATERIAL=M", "*STEP\n*FREQUENCY\n1\n*END STEP", ""]
    path.write_text("\n".join(lines))


def reduce_bars(folder: Path) -> None:
    """Writes NAME.h5 for each bar into a folder, unless it is already there."""
    import simflex

    for bar in BARS:
        target = folder / f"{bar.name}.h5"
        if target.exists():
            continue
        folder.mkdir(parents=True, exist_ok=True)
        write_deck(bar, folder / f"{bar.name}.inp")
        part = simflex.reduce(bar.name, str(folder), deck=f"{bar.name}.inp", modes=18, stiffening=bar.stiffening,
                              interfaces={"near": "NEAR", "far": "FAR"})
        unfinished = folder / f"{bar.name}-{os.getpid()}.h5"
        part.write(unfinished)
        unfinished.rename(target)
