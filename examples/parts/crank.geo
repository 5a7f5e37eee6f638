// Crank: aluminium bar 72 × 12 × 6 mm, pins 60 mm apart, along x; pin axes along z, shaft at the
// origin. Metres. Node sets SHAFT and PIN: the square core of 6 × 6 mm that each pin holds.
length = 0.060; width = 0.012; thickness = 0.006; overhang = 0.006; seat = 0.006;
first = "SHAFT"; second = "PIN";
Include "bar.geo";
