// Stator, part 5: nozzle. Nickel alloy, converging, with a mount ring and a hinge lug below, a ring
// at the exit. x = 1.70 … 2.25 m. Node sets FRONT, MOUNT (bore of the lug).
Include "stator_casing.geo";

ox[] = {1700, 1714, 1714, 1850, 1850, 1886, 1886, 2000, 2120, 2236, 2236, 2250};
or[] = {370, 370, 344, 338, 360, 360, 335, 318, 290, 258, 276, 276};
ix[] = {1680, 1700, 1850, 1886, 2000, 2120, 2250, 2270};
ir[] = {340.8, 340, 333.8, 330.8, 313.8, 285.8, 250, 244.5};
Call Outer;

lugX = 1852; lugThick = 32; lugBase = 350; lugWidth = 150; lugEye = 425; lugOuter = 40; lugBore = 22;
lugAngle = Pi;
Call Lug;
Call Hollow;

frontFace = 1700; rearFace = -1;
Call Finish;
Call LugSeat;
Physical Surface("MOUNT") = {seat[]};
