// A robot's arm: a plate of 300 x 40 x 8 mm between the bores, with two openings. Metres; bores along z,
// the first at the origin. Physical surfaces SHAFT and TOOL: the bores.
SetFactory("OpenCASCADE");
mm = 0.001;
length = 300*mm; width = 40*mm; thickness = 8*mm; bore = 10*mm;
back = -thickness/2;

Box(1) = {0, -width/2, back, length, width, thickness};
Cylinder(2) = {0, 0, back, 0, 0, thickness, width/2};
Cylinder(3) = {length, 0, back, 0, 0, thickness, width/2};
plate() = BooleanUnion{ Volume{1}; Delete; }{ Volume{2, 3}; Delete; };

Cylinder(12) = {0, 0, back, 0, 0, thickness, bore};
Cylinder(13) = {length, 0, back, 0, 0, thickness, bore};
Rectangle(901) = {45*mm, -10*mm, back, 90*mm, 20*mm, 8*mm};
Rectangle(902) = {165*mm, -10*mm, back, 90*mm, 20*mm, 8*mm};
openings() = Extrude {0, 0, thickness} { Surface{901, 902}; };
arm() = BooleanDifference{ Volume{plate()}; Delete; }{ Volume{12, 13, openings(1), openings(11)}; Delete; };

eps = 0.1*mm;
shaft() = Surface In BoundingBox {-bore-eps, -bore-eps, -1, bore+eps, bore+eps, 1};
tool() = Surface In BoundingBox {length-bore-eps, -bore-eps, -1, length+bore+eps, bore+eps, 1};
Physical Volume("BODY") = {arm()};
Physical Surface("SHAFT") = {shaft()};
Physical Surface("TOOL") = {tool()};
