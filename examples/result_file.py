#!/usr/bin/python3
"""Reads a result file of `simflex run` with h5py: what it holds, and the values of probes. The layout
of the file is described in plugin/model/Results.h.

    examples/result_file.py run.h5                       # analyses and probes
    examples/result_file.py run.h5 slider_x crank        # their values, one line for each time
    examples/result_file.py run.h5 slider_x --analysis run --json

Needs python3-h5py and python3-numpy.
"""
import argparse
import json

import h5py
import numpy


def text(value):
    return value.decode() if isinstance(value, bytes) else str(value)


def in_order(group):
    """The members of a group as the run made them."""
    return sorted(group.items(), key=lambda item: int(item[1].attrs["index"]))


def read_analysis(group):
    """An analysis as a dict: its time and probes (rows x columns), or its frequencies."""
    analysis = {"type": text(group.attrs["type"]), "complete": bool(group.attrs["complete"]), "probes": {}}
    for name in ("time", "speeds", "frequency", "damping_ratio"):
        if name in group:
            analysis[name] = group[name][:]
    for name, data in in_order(group["probes"]) if "probes" in group else []:
        analysis["probes"][name] = {
            "unit": text(data.attrs["unit"]),
            "columns": text(data.attrs["columns"]).split(","),
            "values": data[:],
        }
    return analysis


def read_results(path):
    with h5py.File(path, "r") as file:
        if "simflex_results" not in file.attrs:
            raise SystemExit("%s is no result file of simflex" % path)
        if int(file.attrs["simflex_results"]) > 1:
            raise SystemExit("%s is of a newer simflex" % path)
        return {
            "title": text(file.attrs["title"]),
            "model": text(file["model"][()]),
            "analyses": {name: read_analysis(group) for name, group in in_order(file["analyses"])},
        }


def titles_of(name, probe):
    """Titles of a probe's columns: "tip.x [m]"."""
    unit = " [%s]" % probe["unit"] if probe["unit"] else ""
    return [name + ("." + column if column else "") + unit for column in probe["columns"]]


def print_probes(analysis, names):
    missing = [name for name in names if name not in analysis["probes"]]
    if missing:
        raise SystemExit("there is no probe '%s'; there are: %s" % (missing[0], ", ".join(analysis["probes"])))
    probes = [(name, analysis["probes"][name]) for name in names]
    titles = sum([titles_of(*probe) for probe in probes], [])
    table = numpy.hstack([probe["values"] for _, probe in probes])
    if "time" in analysis:
        titles = ["time [s]"] + titles
        table = numpy.column_stack([analysis["time"], table])
    print("  ".join("%16s" % title for title in titles))
    for row in table:
        print("  ".join("%16.9g" % value for value in row))


def print_contents(results):
    print(results["title"])
    for name, analysis in results["analyses"].items():
        print("%s: %s%s" % (name, analysis["type"], "" if analysis["complete"] else ", not complete"))
        if len(analysis.get("time", [])) > 0:
            print("  %d times from %g to %g s" % (len(analysis["time"]), analysis["time"][0], analysis["time"][-1]))
        if analysis["type"] == "eigen":
            print("  frequencies [Hz]: " + " ".join("%.6g" % value for value in analysis["frequency"]))
        for probe in analysis["probes"].items():
            print("  " + ", ".join(titles_of(*probe)))


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("results", metavar="RESULT.h5")
    parser.add_argument("probes", metavar="PROBE", nargs="*", help="probes whose values are printed")
    parser.add_argument("--analysis", help="which analysis; default: the first that has probes")
    parser.add_argument("--json", action="store_true", help="print the analysis as one JSON object")
    arguments = parser.parse_args()

    results = read_results(arguments.results)
    analyses = results["analyses"]
    if arguments.analysis and arguments.analysis not in analyses:
        raise SystemExit("there is no analysis '%s'; there are: %s" % (arguments.analysis, ", ".join(analyses)))
    if not arguments.probes and not arguments.json:
        print_contents(results)
        return
    with_probes = [name for name, analysis in analyses.items() if analysis["probes"]]
    if not arguments.analysis and not with_probes:
        raise SystemExit("no analysis of %s has probes" % arguments.results)
    analysis = analyses[arguments.analysis or with_probes[0]]
    if arguments.json:
        print(json.dumps(analysis, default=lambda array: array.tolist()))
    else:
        print_probes(analysis, arguments.probes)


if __name__ == "__main__":
    main()
