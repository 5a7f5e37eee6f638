// Connecting rod: aluminium bar 192 × 10 × 6 mm, pins 180 mm apart, along x; pin axes along z,
// big end at the origin. Metres. Node sets BIG_END and SMALL_END: cores of 6 × 6 mm.
length = 0.180; width = 0.010; thickness = 0.006; overhang = 0.006; seat = 0.006;
first = "BIG_END"; second = "SMALL_END";
Include "bar.geo";
