"""examples/result_file.py on the file of testing::writeRun()."""
import contextlib
import io
import json
import math
import runpy
import sys

example, path = sys.argv[1:]


def run(*arguments):
    """What the example prints, or says when it gives up; in this process, since Python is slow to start."""
    sys.argv = [example, path, *arguments]
    out = io.StringIO()
    try:
        with contextlib.redirect_stdout(out):
            runpy.run_path(example, run_name="__main__")
    except SystemExit as gone:
        return "given up: %s" % gone
    return out.getvalue()


contents = run()
for text in ("Swing", "rest: static", "run: transient", "100 times from 0 to 0.99 s", "swing.x [m], swing.y [m]",
             "angle [rad]", "frequencies [Hz]: 1 2.5 40", "map: campbell"):
    assert text in contents, (text, contents)

analysis = json.loads(run("--analysis", "run", "--json"))
assert analysis["complete"] and len(analysis["time"]) == 100
for t, (x, y), (angle,) in zip(analysis["time"], analysis["probes"]["swing"]["values"], analysis["probes"]["angle"]["values"]):
    assert math.isclose(x, 2 * math.cos(t)) and math.isclose(y, 2 * math.sin(t)) and angle == t

lines = run("swing", "--analysis", "run").splitlines()
assert len(lines) == 101 and lines[0].split("  ")[-1].strip() == "swing.y [m]", lines[0]
assert [float(word) for word in run("angle").splitlines()[1].split()] == [0]  # the first analysis with probes: rest
assert all(text in run("wing") for text in ("given up", "'wing'", "swing, angle"))
assert all(text in run("--analysis", "walk") for text in ("given up", "'walk'", "rest, run"))
