// Stator, part 1: connector. Titanium cone with an inlet lip, a mount ring with two hinge lugs at
// its sides, a flange at the rear. x = 0 … 0.36 m. Node sets LEFT, RIGHT (bores of the lugs), REAR.
Include "stator_casing.geo";

ox[] = {0, 16, 16, 140, 140, 180, 180, 346, 346, 360};
or[] = {408, 408, 385, 368, 388, 388, 362, 337, 365, 365};
ix[] = {-20, 0, 360, 380};
ir[] = {383, 380, 330, 327};
Call Outer;

lugX = 143; lugThick = 34; lugBase = 376; lugWidth = 150; lugEye = 455; lugOuter = 40; lugBore = 22;
lugAngle = Pi/2;
Call Lug;
lugAngle = -Pi/2;
Call Lug;
Call Hollow;

frontFace = -1; rearFace = 360;
Call Finish;
lugAngle = Pi/2;
Call LugSeat;
Physical Surface("LEFT") = {seat[]};
lugAngle = -Pi/2;
Call LugSeat;
Physical Surface("RIGHT") = {seat[]};
