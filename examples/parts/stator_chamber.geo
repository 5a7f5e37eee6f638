// Stator, part 3: combustion chamber casing. Nickel alloy barrel with eight injector ports and a
// rib. x = 0.90 … 1.30 m. Node sets FRONT, REAR.
Include "stator_casing.geo";

ox[] = {900, 914, 914, 940, 1000, 1120, 1120, 1132, 1132, 1190, 1250, 1286, 1286, 1300};
or[] = {297, 297, 273, 289, 314, 318, 331, 331, 318, 316, 303, 295, 324, 324};
ix[] = {880, 900, 940, 1000, 1120, 1190, 1250, 1300, 1320};
ir[] = {249.6, 262, 285, 310, 314, 312, 299, 288.2, 284};
Call Outer;

bossX = 1060; bossTop = 340; bossOuter = 30; bossBore = 17;
For i In {0:7}
  bossAngle = (i + 0.5)*Pi/4;
  Call Boss;
EndFor
Call Hollow;

frontFace = 900; rearFace = 1300;
Call Finish;
