// Stator, part 2: compressor casing. Titanium cone with four ribs over the vane rings, four bleed
// ports, six struts that carry the front bearing. x = 0.36 … 0.90 m. Node sets FRONT, REAR, BEARING.
Include "stator_casing.geo";

ox[] = {360, 374, 374, 500, 500, 512, 512, 590, 590, 602, 602, 680, 680, 692, 692,
        770, 770, 782, 782, 886, 886, 900};
or[] = {365, 365, 334, 318, 332, 332, 317, 307, 321, 321, 305, 295, 309, 309, 294,
        284, 298, 298, 283, 269, 297, 297};
ix[] = {340, 900, 920};
ir[] = {332.6, 262.6, 260.1};
Call Outer;

bossX = 833; bossTop = 305; bossOuter = 34; bossBore = 22;
For i In {0:3}
  bossAngle = Pi/4 + i*Pi/2;
  Call Boss;
EndFor
Call Hollow;
wall = 4;
hubX = 395; hubLength = 80; hubOuter = 92; hubBore = 68;
strutCount = 6; strutChord = 84; strutThick = 20;
Call BearingFrame;

frontFace = 360; rearFace = 900;
Call Finish;
