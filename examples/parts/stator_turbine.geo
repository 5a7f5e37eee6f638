// Stator, part 4: turbine casing. Nickel alloy cone with three ribs over the vane rings, five struts
// that carry the rear bearing. x = 1.30 … 1.70 m. Node sets FRONT, REAR, BEARING.
Include "stator_casing.geo";

ox[] = {1300, 1314, 1314, 1370, 1370, 1384, 1384, 1440, 1440, 1454, 1454, 1520, 1520, 1534, 1534, 1686, 1686, 1700};
or[] = {324, 324, 296.1, 303.1, 318, 318, 304.9, 311.9, 327, 327, 313.6, 321.9, 337, 337, 323.6, 342.6, 370, 370};
ix[] = {1280, 1700, 1720};
ir[] = {287.5, 340, 342.5};
Call Outer;
Call Hollow;
wall = 4;
hubX = 1590; hubLength = 80; hubOuter = 92; hubBore = 68;
strutCount = 5; strutChord = 84; strutThick = 20;
Call BearingFrame;

frontFace = 1300; rearFace = 1700;
Call Finish;
