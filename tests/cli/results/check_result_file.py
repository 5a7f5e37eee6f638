"""examples/result_file.py on the file of testing::writeRun()."""
import json
import math
import subprocess
import sys

example, path = sys.argv[1:]


def run(*arguments, status=0):
    done = subprocess.run(["/usr/bin/python3", example, path, *arguments],
                          stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
    assert (done.returncode == 0) == (status == 0), done.stdout
    return done.stdout


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
assert "'wing'" in run("wing", status=1) and "swing, angle" in run("wing", status=1)
assert "'walk'" in run("--analysis", "walk", status=1)
