// Chain link with a fork at one end and an eye at the other, that the next link's fork takes up, by
// Gmsh/OpenCASCADE in second-order tetrahedra (C3D10). Metres. Bores 80 mm apart along x, axes along
// z, fork at the origin. Node sets FORK (the bores of both cheeks) and EYE (the bore).
// Element size: gmsh -setnumber h 0.003 …

SetFactory("OpenCASCADE");
DefineConstant[ h = {0.004, Name "Element size"} ];
mm = 0.001;
length = 80*mm;
outer = 9*mm;   // radius of fork and eye
bore = 4*mm;    // radius
thick = 4*mm;   // of eye and shank
gap = 5*mm;     // between the fork's cheeks
fork = 11*mm;   // over both cheeks
base = 14*mm;   // where the fork ends
eps = 0.01*mm;

Cylinder(1) = {0, 0, -fork/2, 0, 0, fork, outer};
Box(2) = {0, -outer, -fork/2, base, 2*outer, fork};
Cylinder(3) = {length, 0, -thick/2, 0, 0, thick, outer};

// Shank: a plate that tapers from 12 to 7 mm.
p = newp;
Point(p) = {base - 2*mm, -6*mm, -thick/2};
Point(p+1) = {length, -3.5*mm, -thick/2};
Point(p+2) = {length, 3.5*mm, -thick/2};
Point(p+3) = {base - 2*mm, 6*mm, -thick/2};
l = newl;
For i In {0:3}
  Line(l+i) = {p+i, p+(i+1)%4};
EndFor
loop = newll;
Curve Loop(loop) = {l:l+3};
face = news;
Plane Surface(face) = {loop};
shank[] = Extrude {0, 0, thick} { Surface{face}; };
whole[] = BooleanUnion{ Volume{1}; Delete; }{ Volume{2, 3, shank[1]}; Delete; };

// The slot is round where the next link's eye turns in it.
v = newv;
Cylinder(v) = {0, 0, -gap/2, 0, 0, gap, outer + 1*mm};
Box(v+1) = {-2*outer, -2*outer, -gap/2, 2*outer, 4*outer, gap};
Cylinder(v+2) = {0, 0, -fork, 0, 0, 2*fork, bore};
Cylinder(v+3) = {length, 0, -fork, 0, 0, 2*fork, bore};
part[] = BooleanDifference{ Volume{whole[0]}; Delete; }{ Volume{v:v+3}; Delete; };

forkSeat[] = Surface In BoundingBox {-bore-eps, -bore-eps, -fork, bore+eps, bore+eps, fork};
eyeSeat[] = Surface In BoundingBox {length-bore-eps, -bore-eps, -fork, length+bore+eps, bore+eps, fork};
Physical Volume("BODY") = {part[]};
Physical Surface("FORK") = {forkSeat[]};
Physical Surface("EYE") = {eyeSeat[]};

Mesh.CharacteristicLengthMin = 0.7*h;
Mesh.CharacteristicLengthMax = h;
Mesh.CharacteristicLengthFromCurvature = 1;
Mesh.MinimumElementsPerTwoPi = 10;
Mesh.ElementOrder = 2;
Mesh.Algorithm3D = 10;  // HXT
Mesh.HighOrderOptimize = 2;  // no element turned inside out by the curved skin
Mesh.SaveGroupsOfNodes = 1;
